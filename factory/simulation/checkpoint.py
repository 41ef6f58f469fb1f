"""Checkpoints: the state of a simulation between two ticks, as arrays and JSON. A simulation that
is made anew and takes one up goes on from there to the last bit as the one that it is of."""

from __future__ import annotations

from factory.nets.undone import Undone
from factory.record.log.blocks import Arrays
from factory.record.log.reader import Log
from factory.simulation.keeping import Keeper, Noting, TakingUp
from factory.simulation.recovery.recovery import Recovery
from factory.simulation.simulation import Simulation
from factory.simulation.supervisor import Supervisor


def checkpoint(simulation: Simulation) -> Arrays | None:
    """The state of a simulation after a tick. None where it has none that could be taken up: where
    robots run their own programs, where others take part, or something has been dropped. A run that
    goes on after failures has one whenever nothing is wrong."""
    hooks, recovery = simulation.world.hooks, _recovery(simulation)
    others = [len(found) > bool(recovery) for found in (hooks.sensors, hooks.gates)]
    if simulation.request.distributed or hooks.before_step or any(others):
        return None
    if recovery is not None and not recovery.is_calm:
        return None
    keeper = Noting()
    _keep(simulation, keeper)
    return keeper.arrays


def take_up(simulation: Simulation, state: Arrays, log: Log) -> None:
    """Let a simulation that has not begun go on from a checkpoint, with which a log ends. Raises
    ValueError, or another of `record.log.kept.BROKEN`, where the two are not of one run of it."""
    world, times = simulation.world, log.fired_t.tolist()
    fired = [*zip(times, log.fired.tolist(), strict=True)]
    past, begin = list[tuple[float, int] | Undone](), 0
    for after, undone in log.undone:
        past += [*fired[begin:after], undone]
        begin = after
    supervisor, recovery = simulation.supervisor, _recovery(simulation)
    assert isinstance(supervisor, Supervisor)
    supervisor.go_over(
        [*past, *fired[begin:]], recovery.exchange_again if recovery else _no_exchange
    )
    _keep(simulation, TakingUp(state))
    if simulation.model is None:
        drops = {dropoff.end for dropoff in simulation.layout.factory.dropoffs}
        world.dropoffs.extend(t for t, event in fired if event in drops)
    else:
        left = log.delivered[1:] > log.delivered[:-1]
        world.dropoffs.extend(log.time[1:][left].tolist())
    _check(simulation, log)


def _recovery(simulation: Simulation) -> Recovery | None:
    account = simulation.world.hooks.account
    return account if isinstance(account, Recovery) else None


def _no_exchange(undone: Undone) -> None:
    raise ValueError(f"{' and '.join(undone.robots)} are exchanged in a run that does not recover")


def _keep(simulation: Simulation, keeper: Keeper) -> None:
    supervisor = simulation.supervisor
    assert isinstance(supervisor, Supervisor)
    supervisor.keep(keeper)
    active = supervisor.active
    simulation.world.keep(keeper, active.bundle, active.axes)
    if (recovery := _recovery(simulation)) is not None:
        recovery.keep(keeper)


def _check(simulation: Simulation, log: Log) -> None:
    """Raises ValueError where a simulation is not where the log ends."""
    world, marked = simulation.world, simulation.supervisor.marked
    if world.time != log.time[-1]:
        raise ValueError("it is of another time than the record before it")
    if [place for place, there in enumerate(marked) if there] != log.marking[-1].tolist():
        raise ValueError("its marking is not that of the record before it")
    x = world.sense()[0] if simulation.model is None else simulation.physical.d.qpos
    if (x != log.qpos[-1]).any():
        raise ValueError("its positions are not those of the record before it")
    if world.delivered() - simulation.before != log.delivered[-1]:
        raise ValueError("its products are not those of the record before it")
