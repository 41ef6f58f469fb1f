"""The engine's model in a log."""

from __future__ import annotations

from factory.record.log.reader import Log, Ragged
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError


def model_of(log: Log, hint: str = "") -> mujoco.MjModel:
    """The model in a log of a run in MuJoCo. Raises InputError (BadLog), with `hint`, where the
    engine refuses it or its states are not those of the log."""
    files = {f"meshes/{name}": content for name, content in log.files.items()}
    try:
        m = mujoco.MjModel.from_xml_string(log.xml, files)
    except ValueError as error:
        raise _bad(f"the log's model is broken: {error}", hint) from error
    setpoints = m.nu if log.ctrl is None else log.ctrl.shape[1]
    if (m.nq, m.nv, m.nu) != (log.qpos.shape[1], log.qvel.shape[1], setpoints):
        raise _bad("the log's states are not those of its model", hint)
    if not (_within(log.active, m.neq, m.nbody, m.nbody) and _within(log.contacts, *2 * [m.ngeom])):
        raise _bad("the log's constraints or contacts are not those of its model", hint)
    return m


def _within(found: Ragged, *counts: int) -> bool:
    """Whether each column numbers some of so many things."""
    numbers = found.values.reshape(-1, len(counts))
    return bool(((numbers >= 0) & (numbers < counts)).all())


def _bad(words: str, hint: str) -> InputError:
    return InputError(Diagnostic("BadLog", words, None, hint))
