"""The engine's model that a log was kept of."""

from __future__ import annotations

from factory.engine import mujoco
from factory.errors import Diagnostic, InputError
from factory.log.reader import Log


def model_of(log: Log, hint: str = "") -> mujoco.MjModel:
    """The model in a log of a run in MuJoCo. Raises InputError (BadLog), with `hint`, where the
    engine refuses it or its states are not those of the log."""
    files = {f"meshes/{name}": content for name, content in log.files.items()}
    try:
        m = mujoco.MjModel.from_xml_string(log.xml, files)
    except ValueError as error:
        raise _bad(f"the log's model is broken: {error}", hint) from error
    if m.nq != log.qpos.shape[1]:
        raise _bad("the log's states are not those of its model", hint)
    return m


def _bad(words: str, hint: str) -> InputError:
    return InputError(Diagnostic("BadLog", words, None, hint))
