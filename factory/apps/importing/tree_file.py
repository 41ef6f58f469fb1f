"""From trees of parts, as nested JSON or YAML, to drafts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from factory.api import PAG, Parameter, Template, Value
from factory.apps.importing.document import DocumentNode as Node
from factory.apps.importing.draft import (
    MATE,
    MOST_NODES,
    PART,
    DraftNode,
    ImportFaults,
    label_of,
    too_many,
)
from factory.apps.importing.part_maker import PartMaker, Placement
from factory.support.errors import did_you_mean
from factory.support.texts import quoted
from factory.theory.problem.parameters import ParameterKind

GROUP = ("name", "children", "operation", "parameters", "at", "quat")
LEAF = (
    "name",
    "part",
    "at",
    *(name for name in ParameterKind.GEOMETRY if name not in ("pos", "mesh")),
)
"""The keys of a sub-assembly, and those of a part."""

EXAMPLE = '{"part": "leg.stl", "at": [0, 0, 0.1]} or {"name": "frame", "children": [...]}'
BARE = '"part": true is a part with no shape of its own'


@dataclass(slots=True)
class TreeReader:
    """Makes drafts of nodes; errors go to the faults. `operations`: those that nodes may name."""

    operations: Mapping[str, Template]
    parts: PartMaker
    faults: ImportFaults
    drafts: list[DraftNode] = field(default_factory=list)

    def read(self, root: Node, name: str) -> list[DraftNode]:
        """The drafts of a tree; a root without a name is called `name`. Raises InputError with
        every fault."""
        self.drafts.append(DraftNode(name, root.position))
        stack = [(root, 0, Placement())]
        while stack:
            node, index, place = stack.pop()
            children, inside = self._node(node, self.drafts[index], place)
            first = len(self.drafts)
            for child in children:
                if len(self.drafts) > MOST_NODES:
                    raise too_many(child.position)
                self.drafts.append(DraftNode("", child.position))
            below = range(first, len(self.drafts))
            self.drafts[index].inputs = list(below)
            entries = zip(children, below, strict=True)
            stack += [(child, number, inside) for child, number in entries][::-1]
        self.parts.check_places()
        self.faults.raise_if_any()
        return self.drafts

    def _node(
        self, node: Node, draft: DraftNode, place: Placement
    ) -> tuple[tuple[Node, ...], Placement]:
        """Complete a draft. Returns the children and their frame."""
        if node.kind == "text":
            self._part({"part": node}, draft, place)
            return (), place
        if node.kind != "object":
            message = f"a node is an object or the name of a mesh, not {node.words}"
            self.faults.add("Syntax", message, node.position, f"for example {EXAMPLE}")
            return (), place
        before = len(self.faults.diagnostics)
        is_group = any(key.content in ("children", "operation") for key, _ in node.content)
        fields = self._fields(node, GROUP if is_group else LEAF)
        self._name(fields, draft)
        if is_group:
            return self._group(fields, draft, place)
        if not {"part", *PAG.SHAPES} & set(fields) and len(self.faults.diagnostics) == before:
            self._empty(draft, "it has neither children nor a part")
        self._part(fields, draft, place)
        return (), place

    def _fields(self, node: Node, keys: tuple[str, ...]) -> dict[str, Node]:
        """The values of a node by their keys; unknown and repeated keys are noted."""
        fields: dict[str, Node] = {}
        for key, value in node.content:
            name = {"mesh": "part", "pos": "at"}.get(str(key.content), str(key.content))
            if name in LEAF and name not in keys:
                message = f"{quoted(name)} is a key of parts, not of sub-assemblies"
                hint = "make the part one of its children"
                self.faults.add("UnknownParameter", message, key.position, hint)
            elif name not in keys:
                hint = did_you_mean(name, list(keys), "keys")
                what = "a sub-assembly" if "children" in keys else "a part"
                message = f"{what} has no key {quoted(name)}"
                self.faults.add("UnknownParameter", message, key.position, hint)
            elif name in fields:
                message = f"{quoted(name)} is given twice"
                self.faults.add("BadValue", message, key.position, "remove one of the two")
            else:
                fields[name] = value
        return fields

    def _name(self, fields: dict[str, Node], draft: DraftNode) -> None:
        name = fields.pop("name", None)
        if name is None:
            return
        if name.kind != "text" or not label_of(name.content):
            message = f"'name' takes a text with a letter or a digit, not {name.words}"
            self.faults.add("BadValue", message, name.position, 'for example "name": "leg"')
        else:
            draft.name, draft.position = label_of(name.content), name.position
            draft.kept = True

    def _empty(self, draft: DraftNode, why: str) -> None:
        what = quoted(draft.name) if draft.name else "a node"
        hint = BARE if "neither" in why else f"for example {EXAMPLE}"
        self.faults.add("EmptyNode", f"{what} is empty: {why}", draft.position, hint)

    def _group(
        self, fields: dict[str, Node], draft: DraftNode, place: Placement
    ) -> tuple[tuple[Node, ...], Placement]:
        children = fields.get("children")
        if children is None or children.kind != "list" or not children.content:
            none = children is None or children.kind in ("list", "null")
            self._empty(draft, "it has no children" if none else "its children are not a list")
            return (), place
        stands = {name: node for name, node in fields.items() if name in ("at", "quat")}
        inside = place.inside(self.parts.metres(self._geometry(stands)))
        self._operation(fields, draft, len(children.content))
        return children.content, inside

    def _operation(self, fields: dict[str, Node], draft: DraftNode, count: int) -> None:
        node = fields.get("operation")
        if node is not None and node.kind != "text":
            message = f"'operation' takes a text, not {node.words}"
            self.faults.add("BadValue", message, node.position, 'for example "operation": "glue"')
            return
        name = MATE if node is None else str(node.content)
        template = self.operations.get(name)
        at = draft.position if node is None else node.position
        if template is None or not template.inputs or name == "dropoff":
            usable = [o.name for o in self.operations.values() if o.inputs and o.name != "dropoff"]
            hint = did_you_mean(name, sorted(usable), "operations")
            message = f"there is no operation {quoted(name)} on sub-assemblies"
            self.faults.add("UnknownOperation", message, at, hint)
            return
        operation = template.signature
        few, many = count < operation.inputs and name != MATE, count > operation.inputs
        if few or (many and not operation.further):
            message = f"{quoted(name)} takes {operation.takes}, not {count}"
            hint = "mate the children in a node of their own first"
            self.faults.add("WrongInputs", message, at, hint)
        draft.operation = name
        draft.parameters = self._parameters(fields.get("parameters"), name, operation.parameters)

    def _parameters(
        self, node: Node | None, operation: str, kinds: Mapping[str, ParameterKind]
    ) -> tuple[Parameter, ...]:
        made: list[Parameter] = []
        if node is not None and node.kind != "object":
            message = f"'parameters' takes an object, not {node.words}"
            hint = 'for example "parameters": {"dwell": 2}'
            self.faults.add("BadValue", message, node.position, hint)
        elif node is not None:
            for key, value in node.content:
                kind = kinds.get(str(key.content))
                if kind is None:
                    hint = did_you_mean(str(key.content), list(kinds), "parameters")
                    message = f"{quoted(operation)} has no parameter {key.words}"
                    self.faults.add("UnknownParameter", message, key.position, hint)
                elif (content := self._value(str(key.content), kind, value)) is not None:
                    made.append(Parameter(key.content, content))
        return tuple(made)

    def _part(self, fields: dict[str, Node], draft: DraftNode, place: Placement) -> None:
        draft.operation = PART
        part = fields.pop("part", None)
        values: dict[str, Value] = {}
        if part is not None and part.kind == "text":
            values["mesh"] = part.content
            draft.name = draft.name or mesh_name(part.content)
        elif part is not None and not (part.kind == "boolean" and part.content):
            message = f"'part' takes the name of a mesh file, or true, not {part.words}"
            self.faults.add("BadValue", message, part.position, f"for example {EXAMPLE}")
        values |= self._geometry(fields)
        at = draft.position if part is None else part.position
        draft.parameters = self.parts.parameters(values, place, at)

    def _geometry(self, fields: dict[str, Node]) -> dict[str, Value]:
        """The geometry parameters of a part, or the place of a sub-assembly."""
        values: dict[str, Value] = {}
        for name, node in fields.items():
            of = "pos" if name == "at" else name
            value = self._value(name, ParameterKind.GEOMETRY[of], node)
            if value is not None:
                values[of] = value
        return values

    def _value(self, name: str, kind: ParameterKind, node: Node) -> Value | None:
        """The value of a parameter; None after a fault."""
        if kind.length == 0 and node.kind == "text" and node.content.isprintable():
            return str(node.content)
        numbers = (node,) if node.kind == "number" else node.content
        if (node.kind == "list") == (kind.length > 1) and node.kind in ("list", "number"):
            content = tuple(n.content for n in numbers if n.kind == "number")
            if len(content) == len(numbers) and kind.fits(content):
                return content if kind.length > 1 else content[0]
        message = f"{quoted(name)} takes {kind.wanted}, not {_shown(node)}"
        listed = kind.example.replace("( ", "[").replace(" )", "]")
        self.faults.add("BadValue", message, node.position, f'for example "{name}": {listed}')
        return None


def mesh_name(path: str) -> str:
    """The name of a part from its mesh: the file's name without folder and suffix."""
    name = PurePosixPath(path.replace("\\", "/"))
    return name.stem if name.suffix.lower() in PAG.MESHES else name.name


def _shown(node: Node) -> str:
    """A node in a message; a list with its items."""
    if node.kind != "list":
        return node.words
    inside = ", ".join(item.words for item in node.content[:6])
    return f"[{inside}{', ...' * (len(node.content) > 6)}]"
