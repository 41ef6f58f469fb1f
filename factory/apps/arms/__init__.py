"""Articulated arms: their kinematics, ways in joint space, and the planning of legs.

Begin with `chain.SerialChain` and `read.chain_of`, which reads one from MJCF; then
`joint_way.JointWay`, the curve that an arm follows, and `legs.leg`, which plans one.
"""
