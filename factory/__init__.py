"""factory: compile a product assembly graph into a factory that is proved live and runs in MuJoCo.

The main job is four calls:

>>> import factory
>>> pag = factory.load_pag("examples/paper.pag")
>>> plan = factory.compile(pag)
>>> [robot.name for robot in plan.robots]
['r1', 'r2', 'r3', 'r4', 'r5', 'r6']
>>> layout = factory.lay_out(plan)
>>> run = factory.run(layout, world="ideal", units=3)
>>> run.products, run.refines_net
(3, True)

With `world="mujoco"`, the default, the same net runs over rigid-body physics.
`factory.verify(plan)` proves that the net is a gear net, live, safe and reversible. Each function
takes a product at any stage: `factory.run("examples/paper.pag")` does it all.
"""

import warnings as _warnings

import factory.notebook as _notebook  # noqa: F401 (puts in the pictures)
from factory.stages import (
    build,
    compile,
    export,
    lay_out,
    load_pag,
    run,
    to_networkx,
    verify,
)
from factory.studies import analyze, fidelity, pareto, plan, revise, sweep
from factory.support.errors import Diagnostic, FactoryError, InputError, MissingError, RunError
from factory.support.namesake import MEND as _MEND
from factory.support.namesake import is_mixed as _is_mixed
from factory.support.settings import Settings
from factory.support.version import __version__ as __version__
from factory.views import env, render, report

__all__ = [
    "Diagnostic",
    "FactoryError",
    "InputError",
    "MissingError",
    "RunError",
    "Settings",
    "analyze",
    "build",
    "compile",
    "env",
    "export",
    "fidelity",
    "lay_out",
    "load_pag",
    "pareto",
    "plan",
    "render",
    "report",
    "revise",
    "run",
    "sweep",
    "to_networkx",
    "verify",
]

if _is_mixed():
    _warnings.warn(f"factory_boy is broken by this package: {_MEND}", stacklevel=2)
