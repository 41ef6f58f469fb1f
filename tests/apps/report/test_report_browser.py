"""The report in a real browser without a screen: it opens from disk without an error, one slider
moves everything, and a click selects in all views."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import factory
from factory.apps.log import LogWriter, read_log
from factory.apps.report import page, recording_of
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.paths import PAPER
from tests.report_values import EVIL, altered
from tests.waiting import until


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "paper.log"
    layout = factory.lay_out(factory.compile(factory.load_pag(PAPER)))
    simulation = Simulation(layout, RunRequest("mujoco", units=2))
    with LogWriter(path, simulation) as writer:
        simulation.run([writer.observe])
    return path


class Tab:
    """A report in a tab of its own, and what went wrong there."""

    def __init__(self, browser: Any, file: Path, **options: Any) -> None:
        options.setdefault("viewport", {"width": 1400, "height": 900})
        self.context = browser.new_context(**options)
        self.page = self.context.new_page()
        self.trouble: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda m: self.trouble.append(f"{m.type}: {m.text}"))
        self.page.on("pageerror", lambda error: self.trouble.append(str(error)))
        self.page.on("dialog", lambda d: (self.trouble.append(d.message), d.dismiss()))
        self.page.on("request", lambda r: self.asked.append(r.url))
        self.page.goto(file.as_uri())
        self.page.evaluate("factoryReport.ready")

    def ask(self, words: str) -> Any:
        """What the page says of itself."""
        return self.page.evaluate(f"factoryReport.{words}")

    def seek(self, time: float) -> None:
        """Move the slider."""
        self.page.locator("#slider").fill(f"{time:.2f}")

    def lit(self, view: str) -> set[str]:
        """What is highlighted in a view, as `robot 3`."""
        script = """root => [...document.querySelectorAll(root + ' .lit')].flatMap(
            e => Object.entries(e.dataset).filter(([k]) => k !== 'body' && k !== 'arc')
              .map(([k, v]) => k + ' ' + v))"""
        return set(self.page.evaluate(script, view))


@pytest.fixture(scope="module")
def tab(browser: Any, log: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    file = tmp_path_factory.mktemp("page") / "paper.html"
    file.write_text(page(recording_of(log)), "utf-8")
    found = Tab(browser, file)
    yield found
    assert not found.trouble, found.trouble
    found.context.close()


def test_it_loads_without_errors_or_network(tab: Tab) -> None:
    assert not tab.trouble
    assert [url for url in tab.asked if not url.startswith(("data:", "blob:"))] == [tab.page.url]
    assert tab.ask("has3d")
    pictures = tab.page.locator(".picture img")
    assert pictures.count() == 6
    assert len({pictures.nth(n).get_attribute("src") for n in range(6)}) >= 5


def test_the_slider_moves_tokens_plan_and_3d_together(tab: Tab, log: Path) -> None:
    kept = read_log(log)
    places = {}
    for time in (0.0, 1.4, 3.1, float(kept.time[-1])):
        tab.seek(time)
        assert abs(tab.ask("time") - time) < 0.011
        after = int((kept.time <= tab.ask("time") + 1e-9).sum())
        row = min(after, len(kept) - 1)  # a tick's state is recorded at its end
        assert tab.ask("marked") == kept.marking[row].tolist()
        shown = tab.page.locator(".token.on").evaluate_all("t => t.map(e => +e.dataset.token)")
        assert sorted(shown) == kept.marking[row].tolist()
        x, y, _ = tab.ask("robot(2)")
        moved = tab.page.locator(".robots [data-robot='2']").get_attribute("transform")
        drawn = [float(word) for word in moved.removeprefix("translate(").rstrip(")").split()]
        assert drawn == pytest.approx([1000 * x, -1000 * y], abs=0.06)
        places[time] = (x, y)
    assert len(set(places.values())) >= 2
    left = tab.page.locator(".cursor").evaluate("c => parseFloat(getComputedStyle(c).left)")
    right = tab.page.locator(".rows").evaluate("r => r.clientWidth")
    assert left == pytest.approx(right - 14, abs=3)


def test_it_plays_and_pauses_by_keyboard(tab: Tab) -> None:
    tab.seek(0)
    tab.page.locator("#net").focus()
    tab.page.keyboard.press("Space")
    until(lambda: tab.ask("time") > 0, lambda: tab.page.wait_for_timeout(10))
    tab.page.keyboard.press("Space")
    stopped = tab.ask("time")
    tab.page.wait_for_timeout(60)
    assert tab.ask("time") == stopped > 0
    tab.page.locator("#slider").focus()
    tab.page.keyboard.press("ArrowRight")
    assert tab.ask("time") > stopped


def test_words_in_bars_are_whole_or_out_of_sight(tab: Tab) -> None:
    script = """spans => spans.map(s => {
        const [bar, words] = [s.parentNode, s].map(e => e.getBoundingClientRect());
        return words.top >= bar.bottom - 1 ? 'out' : words.right <= bar.right ? 'whole' : 'cut';
    })"""
    found = tab.page.locator(".op span").evaluate_all(script)
    assert "whole" in found and "cut" not in found


def test_letters_of_the_net_can_be_read(tab: Tab) -> None:
    """At any scale: those that would be too small are left out, but for the names of robots."""
    script = """texts => texts.filter(t => getComputedStyle(t).display !== 'none').map(
        t => parseFloat(getComputedStyle(t).fontSize) * t.getScreenCTM().a)"""
    texts = tab.page.locator(".net text")
    shown = texts.evaluate_all(script)
    assert len(shown) == texts.count() and min(shown) > 8.99
    for _ in range(6):
        tab.page.locator("#net-out").click()
    far = texts.evaluate_all(script)
    assert len(far) == tab.page.locator(".net .name").count() == 6 and min(far) > 8.99
    tab.page.locator("#net-fit").click()


CLICKS = {
    "tree": (".node[data-label='3']", "label"),
    "gantt": ("#gantt button[data-robot='2']", "robot"),
    "bar": (".op[data-operation='2'] >> nth=0", "place"),
    "place": (".net [data-place='2']", "place"),
    "transition": (".net [data-transition='4'] .bar", "transition"),
    "plan": (".floor .robots [data-robot='2'] .carriage", "robot"),
    "use": (".use[data-robot='2']", "robot"),
    "chain": (".piece[data-operation='2'] >> nth=0", "place"),
}


@pytest.mark.parametrize("name", CLICKS)
def test_a_click_selects_in_all_views(tab: Tab, name: str) -> None:
    tab.page.keyboard.press("Escape")
    tab.seek(3.1)
    selector, kind = CLICKS[name]
    tab.page.locator(selector).click(force=name == "plan")
    assert tab.ask("selected")["kind"] == kind
    assert tab.page.locator("#chosen").is_visible()
    assert "robot 2" in tab.lit(".floor") and "robot 2" in tab.lit("#gantt")
    assert "operation 2" in tab.lit("#gantt") and "label 3" in tab.lit(".tree")
    assert {"place 2", "transition 4"} & tab.lit(".net")
    assert tab.ask("lit3d") > 0
    tab.page.keyboard.press("Escape")
    assert tab.ask("selected") is None and not tab.page.locator(".lit").count()


def test_a_click_in_3d_selects(tab: Tab) -> None:
    tab.seek(0)
    tab.page.locator("#stage").scroll_into_view_if_needed()
    for kind, number in (("robot", 0), ("label", 0)):
        x, y = tab.ask(f"pixel('{kind}', {number})")
        tab.page.mouse.click(x, y)
        assert tab.ask("selected") == {"kind": kind, "number": number}
        assert f"{kind} {number}" in tab.lit(".floor")
    tab.page.keyboard.press("Escape")


NAMED = {
    "transition sub2_s": {"kind": "transition", "number": 4},
    "sub2_s": {"kind": "transition", "number": 4},
    "part part1": {"kind": "label", "number": 0},
    "part1": {"kind": "label", "number": 0},
    " r3 ": {"kind": "robot", "number": 2},
}


@pytest.mark.parametrize("words", NAMED)
def test_things_are_found_by_name(tab: Tab, words: str) -> None:
    tab.page.locator("#find").fill(words)
    tab.page.keyboard.press("Enter")
    assert tab.ask("selected") == NAMED[words]
    assert tab.page.locator("#find").input_value() == ""
    tab.page.locator("#chosen").click()
    assert tab.ask("selected") is None


def test_what_has_no_such_name_is_said(tab: Tab) -> None:
    field, missing = tab.page.locator("#find"), tab.page.get_by_role("status")
    for words in ("part9", "robot part1", "constructor"):
        field.fill(words)
        tab.page.keyboard.press("Enter")
        assert missing.filter(has_text=f"Nothing is called {words}").is_visible()
        assert tab.ask("selected") is None
    field.fill("part")
    assert not missing.filter(has_text="Nothing").count()
    field.fill("")


def test_the_certificate_can_be_saved(tab: Tab) -> None:
    with tab.page.expect_download() as saved:
        tab.page.locator("#save-certificate").click()
    assert '"gear_net"' in Path(saved.value.path()).read_text("utf-8")


def test_a_phone_shows_it_in_one_column(browser: Any, tab: Tab) -> None:
    size = {"width": 390, "height": 844}
    phone = Tab(
        browser,
        Path(tab.page.url.removeprefix("file://")),
        viewport=size,
        is_mobile=True,
        has_touch=True,
        color_scheme="dark",
    )
    assert not phone.trouble
    assert phone.page.evaluate("document.documentElement.scrollWidth") == 390
    lefts = phone.page.locator(".panel").evaluate_all(
        "panels => panels.map(p => p.getBoundingClientRect().left)"
    )
    assert len(set(lefts)) == 1
    phone.page.locator(".node[data-label='0']").tap()
    assert phone.ask("selected") == {"kind": "label", "number": 0}
    phone.context.close()


def test_without_webgl_the_rest_works(browser: Any, tab: Tab) -> None:
    context = browser.new_context()
    view = context.new_page()
    view.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    view.goto(tab.page.url)
    view.evaluate("factoryReport.ready")
    assert "no 3-D" in view.locator("#stage-note").inner_text()
    view.locator("#slider").fill("2")
    assert view.locator(".token.on").count()
    view.locator(".node[data-label='0']").click()
    assert view.locator(".floor .lit").count()
    context.close()


def test_a_part_is_found_in_one_body_with_others(browser: Any, tmp_path: Path, run: Any) -> None:
    kept, file = tmp_path / "fused.log", tmp_path / "fused.html"
    assert run("run", PAPER, "--fuse", "--log", kept, "--quiet").status == 0
    file.write_text(page(recording_of(kept)), "utf-8")
    fused = Tab(browser, file)
    fused.page.locator(".node[data-label='0']").click()
    whole = {"label 0", "label 5"}
    assert fused.lit(".floor .parts") & whole == whole and "label 1" not in fused.lit(".floor")
    assert not fused.trouble
    fused.context.close()


def test_hostile_names_do_nothing(browser: Any, log: Path, tmp_path: Path) -> None:
    bad = altered(log, tmp_path / "evil.log", lambda header: header.update(product=EVIL))
    file = tmp_path / "evil.html"
    file.write_text(page(recording_of(bad)), "utf-8")
    evil = Tab(browser, file)
    assert not evil.trouble
    assert evil.page.locator("h1").inner_text() == EVIL
    assert evil.page.title() == f"{EVIL} – factory report"
    evil.context.close()
