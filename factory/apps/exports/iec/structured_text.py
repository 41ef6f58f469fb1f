"""Declarations of IEC 61131-3 as Structured Text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from factory.apps.exports.iec import declarations as iec


def write(declared: iec.Declarations) -> str:
    """The text: types, then units, each after those that it uses, then the configuration."""
    return "\n".join(_lines(declared)) + "\n"


def _lines(declared: iec.Declarations) -> Iterator[str]:
    yield from (f"(* {iec.comment(text)} *)" for text in (declared.name, *declared.remarks))
    for data_type in declared.types:
        yield from ("TYPE", *_type(data_type), "END_TYPE")
    for unit in declared.units:
        yield from ("", *_unit(unit))
    yield from ("", *_configuration(declared.configuration))


def _type(data_type: iec.DataType) -> Iterator[str]:
    remark = _remark(data_type.comment)
    if isinstance(data_type, iec.ArrayType):
        yield f"    {data_type.name} : ARRAY [1..{data_type.size}] OF {data_type.of};{remark}"
        return
    yield f"    {data_type.name} : STRUCT{remark}"
    yield from _variables(data_type.elements, " " * 8)
    yield "    END_STRUCT;"


def _unit(unit: iec.OrganizationUnit) -> Iterator[str]:
    returns = f" : {unit.returns}" if unit.returns else ""
    yield f"{unit.kind} {unit.name}{returns}"
    for section, variables in unit.sections:
        yield from (section, *_variables(variables, " " * 4), "END_VAR")
    yield from unit.body
    yield f"END_{unit.kind}"


def _variables(variables: Iterable[iec.Variable], indent: str) -> Iterator[str]:
    for variable in variables:
        yield f"{indent}{variable.name} : {variable.type};{_remark(variable.comment)}"


def _remark(text: str) -> str:
    return f" (* {iec.comment(text)} *)" if text else ""


def _configuration(configuration: iec.Configuration) -> Iterator[str]:
    task, program = configuration.task, configuration.program
    yield f"CONFIGURATION {configuration.name}"
    yield f"    RESOURCE {configuration.resource} ON PLC"
    yield f"        TASK {task} (INTERVAL := T#{configuration.scan}ms, PRIORITY := 1);"
    yield f"        PROGRAM {configuration.instance} WITH {task} : {program};"
    yield "    END_RESOURCE"
    yield "END_CONFIGURATION"
