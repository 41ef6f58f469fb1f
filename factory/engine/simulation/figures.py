"""The figures of a run in a few lines."""

from __future__ import annotations

from collections.abc import Iterator

from factory.engine.record.figures import PhysicsFigures
from factory.engine.simulation.run import STEADY, Run
from factory.support.console import POOL_BOUND
from factory.support.progress import paced


def not_tested(physics: PhysicsFigures) -> str:
    """The number of pairs of parts without collision checks, in words."""
    return f"{physics.pairs_excluded} of {physics.pairs} pairs of parts not checked for collisions"


def figures(record: Run, verbose: bool = False) -> Iterator[str]:
    """The figures of a run line by line; `verbose`: with each pair of parts that was not tested for
    contact."""
    cycle = "not yet steady"
    if record.cycle_time_s is not None:
        cycle = f"{record.cycle_time_s:.3f} s"
    elif (least := Run.steady_from(record.period)) > STEADY:
        cycle = f"measured from {least} units on (two periods of {record.period})"
    each = [f"{count} {product}" for product, count in record.by_product.items()]
    yield (
        f"{record.products} of {record.units} products in {record.sim_time_s:.2f} s "
        f"({paced(record.realtime_factor)} times real time, {record.world})"
        + (f": {', '.join(each)}" if len(each) > 1 else "")
    )
    yield (
        f"cycle time {cycle}, predicted {record.predicted_cycle_time_s:.3f} s; "
        f"bottleneck {record.bottleneck}"
    )
    yield (
        f"{record.fired} transitions fired, "
        f"the record {'refines' if record.replays else 'DOES NOT REFINE'} the net"
    )
    physics = record.physics
    if physics is not None:
        chosen = physics.timestep_chosen
        how = "chosen automatically (--timestep)" if chosen else "as requested"
        yield f"timestep {1000 * physics.timestep_s:g} ms, {how}"
        if physics.wip_chosen:
            yield f"at most {physics.wip_chosen} units inside at once: {POOL_BOUND}"
        error = physics.product_error_max_mm
        contacts = f"{physics.unintended_contacts} unintended contacts"
        warnings = f"{physics.engine_warnings} engine warnings"
        yield (
            f"{physics.handoffs} hand-offs, largest gap {physics.handoff_gap_max_mm:.3f} mm; "
            f"product error {'none measured' if error is None else f'{error:.3f} mm'}, "
            f"{physics.joining_error_max_mm:.3f} mm when grips close; "
            + (warnings if physics.excluded else f"{contacts}, {warnings}")
        )
        if physics.grip_gap_max_mm is not None:
            yield f"largest gap between part and gripper: {physics.grip_gap_max_mm:.3f} mm"
        if physics.grip_strength_share_max is not None:
            where = f"{physics.grip_strength_robot} with '{physics.grip_strength_label}'"
            used = 100 * physics.grip_strength_share_max
            yield f"highest grip load: {used:.0f} % of the hand's strength ({where})"
        if physics.excluded:
            yield f"{contacts}; {not_tested(physics)}{'' if verbose else ' (list: -v)'}"
        for one, other in physics.excluded if verbose else ():
            yield f"  not checked: {one} - {other}"
        for pair in physics.contacts[:8]:
            yield f"  contact: {pair}"
        if physics.mating_forces:
            most = max(physics.mating_forces, key=physics.mating_forces.__getitem__)
            yield f"largest force between inputs: {physics.mating_force_max_n:.3f} N, in {most}"
        if physics.fused:
            yield (
                "parts joined for good are merged into one rigid body (--no-fuse: kept separate)"
            )
