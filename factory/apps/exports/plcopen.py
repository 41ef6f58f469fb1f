"""PLCopen XML (TC6 2.01): the programs of Structured Text, as development environments of PLCs
import them."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from factory.apps.exports.iec import declarations as iec
from factory.apps.exports.iec.cell import declarations
from factory.apps.exports.subject import Subject
from factory.support.version import __version__

FORMAT, TAKES, ENDING = "plcopen", "pag", "xml"
OF = "the scan time of the task, 10ms by default"

SPACE = "http://www.plcopen.org/xml/tc6_0201"
XHTML = "http://www.w3.org/1999/xhtml"
KINDS = {"FUNCTION": "function", "FUNCTION_BLOCK": "functionBlock", "PROGRAM": "program"}

DATED = "2000-01-01T00:00:00"
"""When it was made, which the schema asks for: the same, so that the same input gives the same
bytes."""


def export(subject: Subject) -> str:
    """The programs of all robots. Raises InputError where a mode cannot be entered."""
    project = _project(declarations(subject))
    ElementTree.indent(project)
    text = ElementTree.tostring(project, "unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _project(declared: iec.Declarations) -> Element:
    project = Element("project", {"xmlns": SPACE, "xmlns:xhtml": XHTML})
    made = {"companyName": "", "productName": "factory", "productVersion": __version__}
    SubElement(project, "fileHeader", {**made, "creationDateTime": DATED})
    header = SubElement(project, "contentHeader", {"name": declared.name})
    SubElement(header, "Comment").text = "\n".join(declared.remarks)
    coordinates = SubElement(header, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        SubElement(SubElement(coordinates, language), "scaling", {"x": "1", "y": "1"})
    types = SubElement(project, "types")
    data_types = SubElement(types, "dataTypes")
    for data_type in declared.types:
        _data_type(SubElement(data_types, "dataType", {"name": data_type.name}), data_type)
    units = SubElement(types, "pous")
    for unit in declared.units:
        _unit(SubElement(units, "pou", {"name": unit.name, "pouType": KINDS[unit.kind]}), unit)
    _configuration(SubElement(project, "instances"), declared.configuration)
    return project


def _data_type(parent: Element, data_type: iec.DataType) -> None:
    base = SubElement(parent, "baseType")
    if isinstance(data_type, iec.ArrayType):
        array = SubElement(base, "array")
        SubElement(array, "dimension", {"lower": "1", "upper": str(data_type.size)})
        _type(SubElement(array, "baseType"), data_type.of)
    else:
        _variables(SubElement(base, "struct"), data_type.elements)
    _documented(parent, data_type.comment)


def _unit(parent: Element, unit: iec.OrganizationUnit) -> None:
    interface = SubElement(parent, "interface")
    if unit.returns:
        _type(SubElement(interface, "returnType"), unit.returns)
    for section, variables in unit.sections:
        _variables(SubElement(interface, iec.SECTIONS[section]), variables)
    body = SubElement(SubElement(SubElement(parent, "body"), "ST"), "xhtml:p")
    body.text = "\n".join(unit.body)


def _variables(parent: Element, variables: Iterable[iec.Variable]) -> None:
    for variable in variables:
        declared = SubElement(parent, "variable", {"name": variable.name})
        _type(SubElement(declared, "type"), variable.type)
        _documented(declared, variable.comment)


def _type(parent: Element, name: str) -> None:
    if name in iec.ELEMENTARY:
        SubElement(parent, name)
    else:
        SubElement(parent, "derived", {"name": name})


def _documented(parent: Element, comment: str) -> None:
    if comment:
        SubElement(SubElement(parent, "documentation"), "xhtml:p").text = comment


def _configuration(parent: Element, declared: iec.Configuration) -> None:
    configurations = SubElement(parent, "configurations")
    configuration = SubElement(configurations, "configuration", {"name": declared.name})
    resource = SubElement(configuration, "resource", {"name": declared.resource})
    interval = {"interval": f"T#{declared.scan}ms", "priority": "1"}
    task = SubElement(resource, "task", {"name": declared.task, **interval})
    SubElement(task, "pouInstance", {"name": declared.instance, "typeName": declared.program})
