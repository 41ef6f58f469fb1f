"""A plant that a PLC or another controller drives, in place of the supervisor.

`signals.py` has the signals and the plant's own reactions, `driven.py` the plant, `interlock.py`
refuses what the net forbids and `corridors.py` says where axes may go; `opcua.py` and
`opcua_server.py` serve it by OPC UA.
"""
