"""The log of a run, `run --log OUT`: its whole state after every tick, in one file that is only
appended to.

    factory-log 2\\n          magic
    <I length>{...}          header, JSON: versions, command line, world, seed, jitter, units,
                             wip, numbers of the places marked at the start, settings, names of
                             robots, places and transitions, the PAG's name, text and SHA-256, its
                             plan and the templates that it uses (`record.project_table`), its
                             layout (`layout.saved`), what a monitor knows of that, nq, nv
    blocks                   see blocks.py: a letter, length, CRC-32, compressed arrays

    M  the model, once: `xml`, and `mesh/NAME` for each mesh file, bytes (mujoco only)
    T  ticks, about a simulated second of them, and the ends of operations (mujoco only), each
       before the engine goes on, in the order of time:
       time (n,) [s], delivered (n,)      products that have left since the run began
       qpos (n, nq), qvel (n, nv)         the engine's; in the ideal world arc lengths and speeds
       ctrl (n, nu)                       the engine's setpoints; these and qvel to a nanometre
       marking_at, _count, marking        rows where the marking changes, how many places, which
       active_at, _count, active          the same for the active constraints: number, two bodies
       contact_at, _count, contact        rows with contacts, how many, pairs of geoms
       contact_dist                       their distances [m]
       fired_at, fired, fired_t           row, number and time [s] of the transitions fired
       ended_at                           the rows that are ends of operations, not ticks
       undone, bytes                      what was undone, JSON, where anything was
       failures, bytes                    what went wrong so far, JSON as in `run --json` with lists
                                          of what is new, where anything is and the run goes on
    E  the end: the file was closed properly
       figures, bytes (mujoco only)       what its verdict rests on, JSON: see `record.verdict`
       failures, bytes                    what went wrong, JSON as in `run --json`, where the run
                                          goes on after failures
       code, message, bytes               what ended the run, as a diagnostic has it, where it
                                          ended before its units were made

Every block stands for itself and is written at once, so a file that ends in the middle of one lacks
at most the last second. Readers pass over blocks of other letters. While it is written it is locked
(`flock`)."""

from factory.record.log.blocks import MAGIC
from factory.record.log.reader import Log, Ragged, is_log, read_log
from factory.record.log.writer import LogWriter

__all__ = ["MAGIC", "Log", "LogWriter", "Ragged", "is_log", "read_log"]
