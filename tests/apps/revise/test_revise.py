"""The next revision of a product: which labels and robots stay."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from benches.revisions import edited, kept_share, shuffled
from factory.apps.few_robots.sharing import with_lines
from factory.apps.revise.family import family
from factory.apps.revise.inheriting import Inheritance
from factory.apps.revise.matching import label_digests, matching, shifted
from factory.apps.revise.pairing import Pairing
from factory.apps.revise.revision import Revision, revised
from factory.floor.layout.certificate import Fault
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.layout import Layout
from factory.pipeline import Project
from factory.support.errors import InputError
from factory.theory.lang import read_pag, write_pag
from factory.theory.lang.pag_reader import load_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.pag import PAG, Mix, Parameter
from factory.theory.problem.plan import Plan
from tests.command_line import spawn
from tests.paths import EXAMPLES


def refuted(mine: Inheritance, old: Layout, new: Layout, pairing: Pairing) -> Iterator[str]:
    """What is wrong with an inheritance: an entry that is not in the old certificate, is of other
    machines, or whose circuit does not keep them apart in the new net. Uses nothing of how it was
    found."""
    assert old.certificate is not None and new.certificate is not None
    if not old.certificate.holds:
        yield "the old certificate does not hold"
    before, after = old.certificate.apart.excluded, new.certificate.apart.excluded
    net, words = coordinated(new).net, dict[str, str]()
    for a, b in pairing.operations.items():
        words[pairing.old.operations[a].label] = pairing.new.operations[b].label
    for a, b in pairing.robots.items():
        words[pairing.old.robots[a].name] = pairing.new.robots[b].name

    def named(name: str) -> str:
        parts = (" ".join(words.get(w, w) for w in part.split(" ")) for part in name.split(":"))
        return ":".join(parts)

    place = {one.name: n for n, one in enumerate(net.net.places)}
    for number, other in mine.entries.items():
        if not (0 <= number < len(after) and 0 <= other < len(before)):
            yield f"entry {number}: there is no such entry"
            continue
        one, its = after[number], before[other]
        name = f"entry {number}, of {' and '.join(one.machines)}"
        sides = sorted(zip(map(named, its.machines), map(named, its.places), strict=True))
        if sides != sorted(zip(one.machines, one.places, strict=True)):
            yield f"{name}: it is of other machines, or places"
        circuit = [place.get(named(each), -1) for each in its.circuit]
        onward = (*circuit[1:], circuit[0])
        follow = all(net.right[p] == net.left[q] for p, q in zip(circuit, onward, strict=True))
        if -1 in circuit or not follow or sum(net.tokens[p] for p in circuit) != 1:
            yield f"{name}: its circuit is none of the new net"
    if mine.pairs != len(after):
        yield "the pairs are miscounted"


def example(name: str) -> PAG:
    return load_pag(EXAMPLES / f"{name}.pag", all_templates())


def van() -> PAG:
    """The truck's sister: a box in place of bed and logs."""
    nodes = {node.label: node for node in example("truck").nodes}
    values = {"box": (0.17, 0.12, 0.09), "pos": (-0.065, 0.0, 0.105), "density": 300.0}
    parameters = tuple(Parameter(name, value) for name, value in values.items())
    box = replace(nodes["bed"], label="box", parameters=parameters)
    boxed = replace(nodes["loaded"], label="boxed", inputs=("body", "box"))
    made = replace(nodes["truck"], label="van", inputs=("boxed",))
    for label in ("truck", "loaded", "bed", "log1", "log2"):
        nodes.pop(label)
    others = tuple(node for node in nodes.values())
    return PAG("van", (made, boxed, *others, box), None, example("truck").folder)


def hooded() -> PAG:
    """A truck whose hood is joined before its cab."""
    truck = example("truck")
    body = replace(truck["body"], inputs=("rolling", "hood", "cab"))
    return replace(truck, nodes=tuple(body if n.label == "body" else n for n in truck.nodes))


def test_what_becomes_of_the_labels_of_the_truck() -> None:
    found = matching(example("truck"), van())
    assert (found.gone, found.added) == (["log1", "log2"], [])
    assert found.renamed == {"truck": "van", "loaded": "boxed", "bed": "box"}
    assert found.changed == {"bed": "box"}
    assert found.reordered == {}
    assert matching(example("truck"), hooded()).reordered == {"body": "body"}
    assert kept_share(example("truck"), van()) == {
        **{"old": 23, "paired": 21, "program": 20, "contents": 19}
    }


def test_a_product_that_lies_elsewhere_is_the_same() -> None:
    pag = example("truck")
    moved = shifted(pag, (0.1, -0.02, 0.005))
    found = matching(pag, moved)
    assert found.shift == (0.1, -0.02, 0.005)
    assert all(map(found.is_equal, pag.by_label))
    assert label_digests(pag)["log1"] != label_digests(moved)["log1"]


def test_a_step_put_in_is_stepped_over() -> None:
    texts = (
        "root = x; x = mate ( y, c ); y = mate ( a, b ); a = atomic(); b = atomic(); c = atomic()",
        "root = x; x = mate ( z, c ); z = press ( y ); y = mate ( a, b );"
        " a = atomic(); b = atomic(); c = atomic()",
    )
    old, new = (read_pag(text, all_templates()) for text in texts)
    assert matching(old, new).added == ["z"]
    assert matching(new, old).gone == ["z"]
    assert kept_share(old, new)["paired"] == kept_share(old, new)["old"] == 5


def project(pag: PAG) -> Project:
    return Project(pag, all_templates())


@pytest.fixture(scope="module")
def truck_to_van() -> Revision:
    return revised(project(example("truck")), project(van()))


def test_certificate_entries_are_inherited_and_forged_ones_refused(truck_to_van: Revision) -> None:
    found, mine = truck_to_van, truck_to_van.inheritance
    old, new = found.old.layout, found.new.layout
    assert old.certificate is not None and new.certificate is not None
    assert mine.inherited > mine.pairs / 2
    assert [*refuted(mine, old, new, found.pairing)] == []
    here, there = next(iter(mine.entries.items()))
    other = next(n for n in range(mine.pairs) if n not in mine.entries)
    elsewhere = next(n for n in mine.entries.values() if n > there + 20)
    for forged, words in (
        (replace(mine, entries={**mine.entries, other: there}), "of other machines"),
        (replace(mine, entries={**mine.entries, here: elsewhere}), "of other machines"),
        (replace(mine, entries={**mine.entries, here: 10**6}), "no such entry"),
        (replace(mine, pairs=mine.pairs + 1), "miscounted"),
    ):
        assert any(words in fault for fault in refuted(forged, old, new, found.pairing)), words
    false = replace(old.certificate, faults=(Fault("it is not clear", ("r1", "r2")),))
    faulty = replace(old, certificate=false)
    assert "does not hold" in next(refuted(mine, faulty, new, found.pairing))


@pytest.mark.slow
def test_an_added_part_moves_few() -> None:
    """The other robots of a floor, or the new one's own branch; hands stay to the micrometre."""
    old = project(example("gearbox"))
    height = round(float(old.product.high[2] - old.product.low[2]), 3)
    new = edited(old.pag, random.Random(705), 1, ("add",), height)
    assert new["gearbox"].inputs[-1] == "added1"
    found = revised(old, project(new))
    assert sum(kept.place for kept in found.kept) >= 17
    assert sum(kept.module for kept in found.kept) >= 17
    assert [*refuted(found.inheritance, found.old.layout, found.new.layout, found.pairing)] == []


def test_shared_robots_are_refused() -> None:
    old = with_lines(project(example("truck")), [["log1", "log2"]])
    with pytest.raises(InputError, match="shared robots"):
        revised(old, project(van()))


def test_names_of_a_plan_are_checked() -> None:
    for names in (("r1", "r1"), ("x1",), ("r0",), ("r01",), ("1",)):
        with pytest.raises(ValueError, match="names"):
            Plan(names=names)
    with pytest.raises(InputError, match="robots"):
        _ = project(example("truck")).with_plan(Plan(names=("r1", "r7"))).plain


def shuffled_van() -> PAG:
    return shifted(shuffled(van(), random.Random(7)), (0.3, 0.0, -0.01))


def test_a_family_has_what_is_equal_once_whatever_it_is_called(tmp_path: Path) -> None:
    plain, renamed = (
        family(example("truck"), pag, (3, 1), tmp_path) for pag in (van(), shuffled_van())
    )
    assert len(plain.common) == len(renamed.common) == 18
    assert plain.renamed == {} and len(renamed.renamed) == 18
    assert renamed.matching.shift == (0.3, 0.0, -0.01)
    assert read_pag(write_pag(plain.pag), all_templates()) == plain.pag
    assert plain.pag.mix == Mix((("truck", 3), ("van", 1)))
    assert {n.label for n in plain.pag.product("van").nodes} == {n.label for n in van().nodes}
    robots = [len(project(made.pag).planned.robots) for made in (plain, renamed)]
    assert robots == [23, 23]


def basic() -> PAG:
    """A gearbox without its wheel."""
    gearbox = example("gearbox")
    nodes = {node.label: node for node in gearbox.nodes if node.label != "wheel"}
    made = nodes.pop("gearbox")
    inputs = tuple(x for x in made.inputs if x != "wheel")
    made = replace(made, label="basic", inputs=inputs)
    return replace(gearbox, root="basic", nodes=(made, *nodes.values()))


def test_meshes_of_a_family_are_found_from_its_folder(tmp_path: Path) -> None:
    made = family(example("gearbox"), basic(), (1, 1), tmp_path)
    meshes = (str(part.parameter("mesh")) for part in made.pag.parts())
    assert all((tmp_path / mesh).is_file() for mesh in meshes)


def test_command_writes_a_family(tmp_path: Path) -> None:
    (tmp_path / "van.pag").write_text(write_pag(shuffled_van()))
    files = EXAMPLES / "truck.pag", tmp_path / "van.pag"
    done = spawn("mix", *files, "--count", "3:1", "-o", tmp_path / "family.pag", "--json")
    assert (done.status, len(done.json["common"])) == (0, 18)
    assert (tmp_path / "family.pag").read_text().startswith("mix = 3 truck, 1 ")
    for words, code in (
        ((files[0], files[0]), "BadMix"),
        ((*files, "--count", "3"), "BadValue"),
        ((*files, "--count", "0:1"), "BadValue"),
        ((tmp_path / "family.pag", files[1]), "BadMix"),
    ):
        refused = spawn("mix", *words, "-o", tmp_path / "no.pag", "--json")
        assert (refused.status, refused.codes) == (2, [code])
        assert not (tmp_path / "no.pag").exists()


def test_those_that_have_most_in_common_are_paired_first() -> None:
    sizes = dict(zip("abcdef", range(1, 7), strict=True))

    def of(one: str, others: str, two: str, more: str) -> PAG:
        subs = f"{one} = mate ( {', '.join(others)} ); {two} = mate ( {', '.join(more)} )"
        parts = "; ".join(f"{n} = atomic ( density = {sizes[n]}.0 )" for n in others + more)
        return read_pag(f"root = x; x = mate ( {one}, {two} ); {subs}; {parts}", all_templates())

    renamed = matching(of("p", "ab", "q", "cd"), of("s", "ae", "t", "cf")).renamed
    assert renamed.items() >= {"p": "s", "q": "t"}.items()
