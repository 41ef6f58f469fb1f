"""The next revision of a product: which labels and robots stay."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest

from factory.lang import read_pag
from factory.lang.pag_reader import load_pag
from factory.pipeline import all_templates
from factory.plant.matching import label_digests, matching, shifted
from factory.problem.pag import PAG, Parameter
from tests.revisions import edited, kept_share, shuffled

EXAMPLES = Path(__file__).parent.parent / "examples"


def example(name: str) -> PAG:
    return load_pag(EXAMPLES / f"{name}.pag", all_templates())


def van() -> PAG:
    """The truck's sister: a box in place of bed and logs."""
    nodes = {node.label: node for node in example("truck").nodes}
    box = replace(nodes["bed"], label="box", parameters=(Parameter("box", (0.17, 0.12, 0.09)),))
    boxed = replace(nodes["loaded"], label="boxed", inputs=("body", "box"))
    made = replace(nodes["truck"], label="van", inputs=("boxed",))
    for label in ("truck", "loaded", "bed", "log1", "log2"):
        nodes.pop(label)
    others = tuple(node for node in nodes.values())
    return PAG("van", (made, boxed, *others, box), None, example("truck").folder)


def test_what_becomes_of_the_labels_of_the_truck() -> None:
    found = matching(example("truck"), van())
    assert (found.gone, found.added) == (["log1", "log2"], [])
    assert found.renamed == {"truck": "van", "loaded": "boxed", "bed": "box"}
    assert found.changed == {"bed": "box"}
    assert kept_share(example("truck"), van()) == {
        **{"old": 23, "paired": 21, "program": 20, "contents": 19}
    }


@pytest.mark.parametrize("name", ["truck", "chair", "gearbox", "paper"])
def test_all_labels_renamed_change_nothing(name: str) -> None:
    pag = example(name)
    share = kept_share(pag, shuffled(pag, random.Random(1)))
    assert len({*share.values()}) == 1


@pytest.mark.parametrize("name", ["truck", "chair", "gearbox"])
def test_mappings_are_one_to_one_and_keep_ancestors(name: str) -> None:
    pag = example(name)
    for seed in range(30):
        new = shuffled(edited(pag, rng := random.Random(seed), 1 + seed % 10), rng)
        labels = matching(pag, new).labels
        assert len({*labels.values()}) == len(labels)
        for label, other in labels.items():
            below, there = ({*_below(tree, x)} for tree, x in ((pag, label), (new, other)))
            assert {labels[x] for x in below if x in labels} <= there


def test_few_edits_keep_most_robots() -> None:
    pag, total = example("truck"), []
    for seed in range(20):
        share = kept_share(pag, edited(pag, random.Random(seed * 31 + 1), 1))
        total.append(share["paired"] / share["old"])
    assert sum(total) / len(total) > 0.96


def test_a_product_that_lies_elsewhere_is_the_same() -> None:
    pag = example("truck")
    moved = shifted(pag, (0.1, -0.02, 0.005))
    found = matching(pag, moved)
    assert found.shift == (0.1, -0.02, 0.005)
    assert all(map(found.is_equal, pag.by_label))
    assert label_digests(pag)["log1"] != label_digests(moved)["log1"]


def test_a_digest_is_of_the_content_of_meshes() -> None:
    pag = example("gearbox")
    lid = pag["lid"].parameter("mesh")
    other = tuple(
        replace(
            n,
            parameters=tuple(
                replace(p, value="gearbox/foot.obj") if p.value == lid else p for p in n.parameters
            ),
        )
        for n in pag.nodes
    )
    found = matching(pag, replace(pag, nodes=other))
    assert found.changed == {"lid": "lid"}


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


def _below(pag: PAG, label: str) -> list[str]:
    todo = [label]
    for x in todo:
        todo += pag[x].inputs
    return todo
