"""The arms of a cell as a table: in the header of a log of its run, beside the table of the project
that its product was given as."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from factory.api import Project
from factory.apps.arms.cell_arm import CellArm
from factory.support.errors import usage_error


@dataclass(frozen=True, slots=True)
class CellTable:
    """The arms of a cell.

    Attributes:
        kind: their name, as a robot type.
        arms: how many there are.
        crew: what each is to place, where that is said.
        text: the MJCF of an arm of a user; empty for one that is shipped.
        files: its meshes by name, in Base64.
    """

    kind: str
    arms: int
    crew: tuple[CellArm, ...] = ()
    text: str = field(default="", repr=False)
    files: Mapping[str, str] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if not (self.kind.isidentifier() and self.kind.isascii()):
            raise ValueError(f"kind must be the name of a robot type, not {self.kind!r:.40}")
        if self.arms not in (1, 2):
            raise ValueError(f"arms must be 1 or 2, not {self.arms}")
        if self.crew and len(self.crew) != self.arms:
            raise ValueError(f"crew must be a list of {self.arms}, not of {len(self.crew)}")

    def project(self, product: Project) -> Project:
        """The project of the cell.

        Args:
            product: the project of its product.

        Raises InputError, or ValueError for an arm that is not shipped or not admitted.
        """
        from factory.apps.arms.ground import cell_of
        from factory.apps.arms.model import KINDS, ArmModel, arm_model
        from factory.apps.log.admission import admitted

        arms = self.crew or (CellArm(),) * self.arms
        if self.text:
            files = {name: b64decode(each, validate=True) for name, each in self.files.items()}
            text = admitted(self.text, files)
            return cell_of(product, arm_model(self.kind, Path(self.kind), text, files), arms)
        if self.kind not in KINDS:
            raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {self.kind!r:.40}")
        return cell_of(product, ArmModel.of(self.kind), arms)


def cell_in(project: Project) -> tuple[Project, CellTable] | None:
    """The project of the product of a cell, and its arms; None for a project on rails.

    Args:
        project: of a cell, perhaps.

    Raises InputError (Usage) for an arm of a user that would not be admitted from a log.
    """
    from factory.apps.arms.ground import CellGround
    from factory.apps.arms.model import KINDS
    from factory.apps.log.admission import admitted

    ground = project.ground
    if not isinstance(ground, CellGround) or ground.model is None or ground.source is None:
        return None
    model = ground.model
    crew = ground.arms if any(arm.labels for arm in ground.arms) else ()
    if model.kind in KINDS:
        return ground.source, CellTable(model.kind, len(ground.arms), crew)
    try:
        admitted(model.text, model.files)
    except ValueError as error:
        message = f"no log can be kept with the arm of {model.file}: {error}"
        raise usage_error(message, "leave that out of its file, or leave out --log") from error
    files = {name: b64encode(content).decode() for name, content in model.files.items()}
    return ground.source, CellTable(model.kind, len(ground.arms), crew, model.text, files)
