"""The log of a run, `run --log OUT`: its state after every tick, in one append-only file.

    factory-log 2\\n          magic
    <I length>{...}          header, JSON: versions, command line, world, seed, jitter, units,
                             wip, numbers of the places marked at the start, settings, names of
                             robots, places and transitions, the PAG's name, text and SHA-256, its
                             plan and the templates that it uses (`record.project_table`), its
                             layout (`layout.saved`) or, with arms, its cell (`cell_table`), the
                             data of a monitor, nq, nv
    blocks                   see blocks.py: a letter, length, CRC-32, compressed arrays

    M  the model, once: `xml`, and `mesh/NAME` for each mesh file, bytes (mujoco only)
    T  about a simulated second of ticks, and the ends of operations (mujoco only), each before
       the engine continues, in the order of time:
       time (n,) [s], delivered (n,)      products that have left since the run began
       qpos (n, nq), qvel (n, nv)         the engine's; in the ideal world arc lengths and speeds
       ctrl (n, nu)                       the engine's setpoints; these and qvel to a nanometre
       marking_at, _count, marking        rows where the marking changes, how many places, which
       active_at, _count, active          the same for the active constraints: number, two bodies
       contact_at, _count, contact        rows with contacts, how many, pairs of geoms
       contact_dist                       their distances [m]
       fired_at, fired, fired_t           row, number and time [s] of the transitions fired
       ended_at                           the rows that are ends of operations, not ticks
       undone, bytes                      undos, JSON, where there are any
       failures, bytes                    failures so far, JSON as in `run --json`, whose lists
                                          have only new entries, where there are any
       units                              on demand, the units of the net that are made, as far as
                                          that is fixed, and last of how many it is known
    E  the end: the file was closed properly
       figures, bytes (mujoco only)       the figures of its verdict, JSON: see `record.verdict`
       failures, bytes                    all failures, JSON as in `run --json`, where the run
                                          recovers from failures
       code, message, bytes               those of the diagnostic that ended the run, where it
                                          ended before all units were made

Every block is self-contained and is written at once, so a file that ends within one lacks at most
the last second. Readers skip blocks of other letters. The file is locked while it is written
(`flock`)."""

from factory.apps.log.blocks import MAGIC
from factory.apps.log.reader import Log, Ragged, is_log, read_log
from factory.apps.log.writer import LogWriter

__all__ = ["MAGIC", "Log", "LogWriter", "Ragged", "is_log", "read_log"]
