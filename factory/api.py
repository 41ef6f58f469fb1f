"""The interface of the core: the names that apps, exporters and other packages import.

Each is documented where it is defined. A name loads its module when it is imported from here, and
nothing else: `import factory.api` loads neither numpy nor the engine.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from factory.engine.mjcf import names as names
    from factory.engine.mjcf.loading import load as load
    from factory.engine.mjcf.model import Model as Model
    from factory.engine.mjcf.replica import Geoms as Geoms
    from factory.engine.mjcf.replica import Replica as Replica
    from factory.engine.mjcf.weld_frames import WeldFrames as WeldFrames
    from factory.engine.record.ending import CutOff as CutOff
    from factory.engine.record.failures import Failing as Failing
    from factory.engine.record.failures import Failures as Failures
    from factory.engine.record.findings import Report as Report
    from factory.engine.record.state import Event as Event
    from factory.engine.record.state import Observation as Observation
    from factory.engine.record.state import Observer as Observer
    from factory.engine.record.state import Recordable as Recordable
    from factory.engine.record.state import Recorder as Recorder
    from factory.engine.record.state import State as State
    from factory.engine.record.subject import MonitorSubject as MonitorSubject
    from factory.engine.record.subject import MonitorTable as MonitorTable
    from factory.engine.record.verdict import RunVerdict as RunVerdict
    from factory.engine.simulation.modelling import physical_model as physical_model
    from factory.engine.simulation.mujoco.world import MujocoWorld as MujocoWorld
    from factory.engine.simulation.request import RunRequest as RunRequest
    from factory.engine.simulation.run import Run as Run
    from factory.engine.simulation.simulation import Simulation as Simulation
    from factory.engine.simulation.world import World as World
    from factory.engine.timing.demand import Demand as Demand
    from factory.engine.timing.timed import pace as pace
    from factory.engine.timing.timing import Timing as Timing
    from factory.film.picture import Picture as Picture
    from factory.film.shot import Shot as Shot
    from factory.floor.geometry.drawn_solids import DrawnSolids as DrawnSolids
    from factory.floor.geometry.meshes import Mesh as Mesh
    from factory.floor.geometry.product import product_geometry as product_geometry
    from factory.floor.geometry.solids import Product as Product
    from factory.floor.geometry.solids import Solid as Solid
    from factory.floor.layout.bending import Detour as Detour
    from factory.floor.layout.certificate import Certificate as Certificate
    from factory.floor.layout.certificate import Region as Region
    from factory.floor.layout.dimensions import Dimensions as Dimensions
    from factory.floor.layout.durations import Pace as Pace
    from factory.floor.layout.guidepath import Guidepath as Guidepath
    from factory.floor.layout.hands.choosing import Hands as Hands
    from factory.floor.layout.hands.hand import Hand as Hand
    from factory.floor.layout.hands.misses import NoGrip as NoGrip
    from factory.floor.layout.layout import Layout as Layout
    from factory.floor.layout.layout_machines import LayoutMachines as LayoutMachines
    from factory.floor.layout.layout_search import LayoutSearch as LayoutSearch
    from factory.floor.layout.request import Ground as Ground
    from factory.floor.layout.saved import LayoutTable as LayoutTable
    from factory.floor.mating.finder import Finder as Finder
    from factory.floor.mating.findings import Matings as Matings
    from factory.floor.robots.catalogue import load_catalogue as load_catalogue
    from factory.pipeline import Project as Project
    from factory.support.apps import App as App
    from factory.support.bounds import WorldName as WorldName
    from factory.support.errors import Diagnostic as Diagnostic
    from factory.support.errors import FactoryError as FactoryError
    from factory.support.errors import InputError as InputError
    from factory.support.errors import RunError as RunError
    from factory.support.settings import Settings as Settings
    from factory.theory.compiler.expanding import Node as Node
    from factory.theory.control.laws import Setting as Setting
    from factory.theory.control.laws import navigation as navigation
    from factory.theory.control.mode import Limits as Limits
    from factory.theory.control.mode import Mode as Mode
    from factory.theory.lang.pag_reader import load_pag as load_pag
    from factory.theory.lang.pag_reader import read_pag as read_pag
    from factory.theory.lang.source import read_text as read_text
    from factory.theory.lang.template_reader import all_templates as all_templates
    from factory.theory.lang.template_reader import read_template as read_template
    from factory.theory.lang.writer import write_pag as write_pag
    from factory.theory.lang.writer import write_template as write_template
    from factory.theory.nets.coordinated import Order as Order
    from factory.theory.nets.coordinated import Past as Past
    from factory.theory.nets.gears import Gear as Gear
    from factory.theory.nets.gears import GearNet as GearNet
    from factory.theory.nets.marked import MarkedNet as MarkedNet
    from factory.theory.nets.petri import Marking as Marking
    from factory.theory.nets.petri import PetriNet as PetriNet
    from factory.theory.nets.petri import Place as Place
    from factory.theory.nets.petri import Transition as Transition
    from factory.theory.nets.undone import Undone as Undone
    from factory.theory.nets.verdict import Defect as Defect
    from factory.theory.nets.verdict import Verdict as Verdict
    from factory.theory.nets.verify import GearProof as GearProof
    from factory.theory.nets.verify import proved as proved
    from factory.theory.nets.verify import verify as verify
    from factory.theory.plant.approaches import Approach as Approach
    from factory.theory.plant.factory import Factory as Factory
    from factory.theory.plant.operation import Operation as Operation
    from factory.theory.plant.robot import Robot as Robot
    from factory.theory.problem.pag import NOPART as NOPART
    from factory.theory.problem.pag import PAG as PAG
    from factory.theory.problem.pag import AllowedOverlap as AllowedOverlap
    from factory.theory.problem.pag import Assembly as Assembly
    from factory.theory.problem.pag import Parameter as Parameter
    from factory.theory.problem.pag import Value as Value
    from factory.theory.problem.plan import Plan as Plan
    from factory.theory.problem.robot_types import Catalogue as Catalogue
    from factory.theory.problem.template import Template as Template

HOMES = {
    "support.errors": "Diagnostic FactoryError InputError RunError",
    "support.settings": "Settings",
    "support.apps": "App",
    "support.bounds": "WorldName",
    "theory.problem.pag": "Assembly NOPART PAG Parameter Value AllowedOverlap",
    "theory.problem.plan": "Plan",
    "theory.problem.robot_types": "Catalogue",
    "theory.problem.template": "Template",
    "theory.lang.pag_reader": "load_pag read_pag",
    "theory.lang.source": "read_text",
    "theory.lang.writer": "write_pag write_template",
    "theory.lang.template_reader": "all_templates read_template",
    "theory.nets.gears": "Gear GearNet",
    "theory.nets.marked": "MarkedNet",
    "theory.nets.petri": "Marking PetriNet Place Transition",
    "theory.nets.undone": "Undone",
    "theory.nets.verdict": "Verdict Defect",
    "theory.nets.verify": "proved verify GearProof",
    "theory.nets.coordinated": "Past Order",
    "theory.control.laws": "Setting navigation",
    "theory.control.mode": "Limits Mode",
    "engine.timing.demand": "Demand",
    "theory.plant.factory": "Factory",
    "theory.plant.operation": "Operation",
    "theory.plant.robot": "Robot",
    "theory.plant.approaches": "Approach",
    "theory.compiler.expanding": "Node",
    "floor.geometry.meshes": "Mesh",
    "floor.geometry.solids": "Product Solid",
    "floor.geometry.product": "product_geometry",
    "floor.geometry.drawn_solids": "DrawnSolids",
    "floor.robots.catalogue": "load_catalogue",
    "floor.mating.finder": "Finder",
    "floor.mating.findings": "Matings",
    "floor.layout.certificate": "Certificate Region",
    "floor.layout.durations": "Pace",
    "floor.layout.guidepath": "Guidepath",
    "floor.layout.hands.choosing": "Hands",
    "floor.layout.hands.hand": "Hand",
    "floor.layout.layout": "Layout",
    "floor.layout.request": "Ground",
    "floor.layout.saved": "LayoutTable",
    "floor.layout.layout_machines": "LayoutMachines",
    "floor.layout.layout_search": "LayoutSearch",
    "floor.layout.bending": "Detour",
    "floor.layout.hands.misses": "NoGrip",
    "floor.layout.dimensions": "Dimensions",
    "engine.mjcf": "names",
    "engine.mjcf.model": "Model",
    "engine.mjcf.replica": "Geoms Replica",
    "engine.mjcf.loading": "load",
    "engine.mjcf.weld_frames": "WeldFrames",
    "engine.timing.timed": "pace",
    "engine.timing.timing": "Timing",
    "engine.record.ending": "CutOff",
    "engine.record.failures": "Failing Failures",
    "engine.record.findings": "Report",
    "engine.record.state": "Event Observation Observer Recordable Recorder State",
    "engine.record.subject": "MonitorSubject MonitorTable",
    "engine.record.verdict": "RunVerdict",
    "engine.simulation.modelling": "physical_model",
    "engine.simulation.mujoco.world": "MujocoWorld",
    "engine.simulation.request": "RunRequest",
    "engine.simulation.run": "Run",
    "engine.simulation.simulation": "Simulation",
    "engine.simulation.world": "World",
    "pipeline": "Project",
    "film.picture": "Picture",
    "film.shot": "Shot",
}
"""The names by the modules that define them, in the order of the house."""

_HOME = {name: home for home, names in HOMES.items() for name in names.split()}

__all__ = sorted(_HOME)

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """The object of a name, from its home; a module where the home has one of this name."""
        if name not in _HOME:
            raise AttributeError(f"module 'factory.api' has no attribute '{name}'")
        home = import_module(f"factory.{_HOME[name]}")
        if not hasattr(home, name):
            return import_module(f"{home.__name__}.{name}")
        return getattr(home, name)
