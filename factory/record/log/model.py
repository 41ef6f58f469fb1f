"""The engine's model in a log."""

from __future__ import annotations

from factory.mjcf.loading import compiled
from factory.record.log.admitted import admitted
from factory.record.log.reader import Log, Ragged
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError
from factory.support.files import AGAIN


def model_of(log: Log) -> mujoco.MjModel:
    """The model in a log. Raises InputError (BadLog) for a log of the ideal world, or one that ends
    before its first ticks, where the model is none that is written (`admitted`) or the engine
    refuses it, and where its states are not those of the log."""
    if log.header["world"] == "ideal":
        hint = "keep a log of a run in MuJoCo: `factory run FILE.pag --log OUT`"
        raise _bad("the log is of the ideal world, which has no bodies to show", hint)
    if not len(log):
        why = f": {log.cut_off.message}" if log.cut_off else ""
        raise _bad(f"the log is cut off before its first simulated second{why}")
    try:
        m = compiled(admitted(log.xml, log.files), log.files)
    except ValueError as error:
        raise _bad(f"the log's model is broken: {error}") from error
    if [m.nq, m.nv, m.nu] != [s.shape[1] for s in (log.qpos, log.qvel, log.ctrl) if s is not None]:
        raise _bad("the log's states are not those of its model")
    if not (_within(log.active, m.neq, m.nbody, m.nbody) and _within(log.contacts, *2 * [m.ngeom])):
        raise _bad("the log's constraints or contacts are not those of its model")
    return m


def _within(found: Ragged, *counts: int) -> bool:
    """Whether each column numbers some of so many things."""
    numbers = found.values.reshape(-1, len(counts))
    return bool(((numbers >= 0) & (numbers < counts)).all())


def _bad(words: str, hint: str = AGAIN) -> InputError:
    return InputError(Diagnostic("BadLog", words, None, hint))
