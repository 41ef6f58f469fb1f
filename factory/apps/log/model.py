"""The engine's model in a log, which may come from anyone (`admission`)."""

from __future__ import annotations

from factory.api import Diagnostic, InputError
from factory.apps.log.admission import admitted
from factory.apps.log.content import AGAIN
from factory.apps.log.reader import Log, Ragged
from factory.support.compiling import compiled
from factory.support.engine import mujoco


def model_of(log: Log) -> mujoco.MjModel:
    """The model in a log. Raises InputError (BadLog) for a log of the ideal world, for one that
    ends before its first ticks, for a model that is not admitted or not compiled by the engine, and
    where the states of the log have other sizes."""
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


def _within(ragged: Ragged, *counts: int) -> bool:
    """Whether the numbers in each column are below the count of that column."""
    numbers = ragged.values.reshape(-1, len(counts))
    return bool(((numbers >= 0) & (numbers < counts)).all())


def _bad(words: str, hint: str = AGAIN) -> InputError:
    return InputError(Diagnostic("BadLog", words, None, hint))
