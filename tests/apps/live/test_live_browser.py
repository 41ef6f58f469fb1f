"""The live page in a real browser without a screen: it shows the run, and its buttons act on it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

from factory.apps.deviations import Campaign, Deviation
from factory.apps.live import Server
from factory.apps.live.page import page
from tests.live_sessions import Running, a_session
from tests.waiting import until


class Watched:
    """A running factory with a page open on it."""

    def __init__(self, browser: Any, campaign: Campaign | None = None, **options: Any) -> None:
        self.running = Running(True, campaign)
        self.server = Server(self.running.session, page(a_session(False, campaign)))
        self.context = browser.new_context(viewport={"width": 1400, "height": 900}, **options)
        self.page = self.context.new_page()
        self.trouble: list[str] = []
        self.page.on("console", lambda m: self.trouble.append(f"{m.type}: {m.text}"))
        self.page.on("pageerror", lambda error: self.trouble.append(str(error)))
        self.page.goto(self.server.address)
        self.page.evaluate("factoryView.ready")

    def until(self, words: str) -> None:
        """Wait until something holds of the newest frame, `f`."""
        self.seen(f"f => f && ({words})", "factoryView.frame")

    def seen(self, holds: str, of: str) -> None:
        """Wait until something holds; the page's policy lets it evaluate nothing by itself."""
        page = self.page
        until(lambda: page.evaluate(f"({holds})({of})"), lambda: page.wait_for_timeout(30))

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def close(self) -> None:
        self.context.close()
        self.server.close()
        self.running.close()


@pytest.fixture
def watched(browser: Any) -> Iterator[Watched]:
    made = Watched(browser)
    yield made
    made.close()


def test_robots_tokens_and_bars_move(watched: Watched) -> None:
    watched.until("f.count > 8")
    look = """() => [
        factoryView.robot(1),
        [...document.querySelectorAll('.token.on')].map(t => t.dataset.token),
        [...document.querySelectorAll('.rolling .op')].map(bar => bar.title),
    ]"""
    first = watched.page.evaluate(look)
    watched.until(f"f.count > {watched.page.evaluate('factoryView.frame.count') + 8}")
    for number in (0, 1):  # where a cycle brings them back, a moment later
        moved = f"drawn => `${{drawn[{number}]}}` != `${{{json.dumps(first[number])}}}`"
        watched.seen(moved, f"({look})()")
    watched.press("Pause")
    watched.until("!f.playing")
    world = watched.running.session.simulation.world
    there = pytest.approx(world.d.xpos[world.m.body("r2/carriage").id].tolist(), abs=1e-3)
    until(lambda: watched.page.evaluate("factoryView.robot(1)") == there)
    _, tokens, bars = watched.page.evaluate(look)
    assert {*bars} - {*first[2]}, "bars of later units"
    frame = watched.page.evaluate("factoryView.frame")
    assert sorted(map(int, tokens)) == sorted(frame["marked"]), "the drawing is the marking"
    assert watched.trouble == []


def test_buttons_step_slow_push_and_block(watched: Watched) -> None:
    watched.until("f.count > 2")
    watched.press("Pause")
    watched.until("!f.playing")
    before = watched.page.evaluate("factoryView.frame.count")
    watched.press("Next firing")
    watched.until(f"f.count > {before} && !f.playing")
    watched.press("Play")
    watched.page.locator("#gantt button[data-robot='1']").click()
    watched.press("25 %")
    watched.until("f.slowed['1'] === 0.25")
    slowed = "[...document.querySelectorAll('#gantt button.slowed')].map(b => b.textContent)"
    watched.seen("names => names.join() === 'r2'", slowed)
    button = watched.page.get_by_role("button", name="ahead ▸▸")
    button.hover()
    watched.page.mouse.down()
    world = watched.running.session.simulation.world
    body = world.m.body("r2/carriage").id
    watched.running.until(lambda f: abs(world.d.xfrc_applied[body, :3]).max() > 1)
    watched.page.mouse.up()
    watched.running.until(lambda f: abs(world.d.xfrc_applied[body, :3]).max() == 0)
    watched.press("r2 at 25 % ✕")
    watched.until("!f.slowed['1']")
    watched.page.locator("#tree [data-label] b", has_text="part1").click()
    watched.press("blocked")
    watched.page.locator("#speed").select_option("10")
    watched.until("f.note.includes('feeder of part1')")
    watched.seen("note => !note.hidden", "document.getElementById('note')")
    watched.press("open")
    watched.until("!f.note")
    watched.press("Restart")
    watched.until("f.run === 1")
    assert watched.trouble == []


def test_a_page_whose_server_is_gone_says_how_to_start_it(watched: Watched) -> None:
    watched.until("f.count > 2")
    offered = watched.page.locator("#acts button").all_inner_texts()
    assert offered == [f"r{n}" for n in range(1, 7)] + ["part3", "part1", "part2"]
    watched.page.locator("#acts button", has_text="part3").click()
    assert watched.page.locator("#acts h3").all_inner_texts()[-1] == "part3"
    watched.page.keyboard.press("Escape")
    watched.page.locator("#gantt button[data-robot='1']").click()
    assert watched.page.locator("#acts button:enabled").count() > 3
    assert watched.page.locator("#gone").is_hidden()
    watched.press("◂◂ back")
    watched.seen(
        "a => a.textContent.startsWith('r2 was pushed back')", "document.getElementById('answer')"
    )
    watched.server.close()
    watched.seen("gone => !gone.hidden", "document.getElementById('gone')")
    assert "factory view FILE.pag" in (watched.page.locator("#gone").text_content() or "")
    assert watched.page.locator("#acts button:enabled, #run button:enabled").count() == 0
    assert watched.page.locator("#speed").is_disabled()


def assert_marked(watched: Watched, state: str, *marks: str) -> None:
    """Exactly these are marked: names in the chart, robots in the plan, tags over the 3-D view."""
    places = ("#gantt button", ".floor [data-body]", "#tags ")
    found = ", ".join(f"...document.querySelectorAll('{place}.{state}')" for place in places)
    words = f"[{found}].map(e => e.textContent || e.dataset.robot).join()"
    watched.seen(f"found => found === '{','.join(marks)}'", words)


def test_what_is_out_of_order_is_marked_and_said(browser: Any) -> None:
    drop = Deviation("drop", robot="r6", at=5.0)
    watched = Watched(browser, Campaign((drop,), clear=60.0, spares=1, swap=60.0))
    watched.until("f.outages.zones.length && f.outages.closed.includes('r6')")
    watched.press("Pause")
    watched.until("!f.playing")
    watched.seen("n => n === 1", "factoryView.zones")
    assert watched.page.locator(".floor .zone").count() == 1
    assert watched.page.locator("#outages .closed").inner_text().endswith(" s")
    closed = watched.page.evaluate("factoryView.frame.outages.closed")
    numbers = [str(int(name.removeprefix("r")) - 1) for name in closed]
    assert_marked(watched, "closed", *closed, *numbers, *closed)
    watched.press("Play")
    watched.page.locator("#speed").select_option("0")
    watched.until("f.outages.told.length === 0")
    watched.seen("n => n === 0", "factoryView.zones")
    assert watched.page.locator("#outages").is_hidden()
    watched.page.locator("#gantt button[data-robot='1']").click()
    watched.press("Kill")
    watched.until("f.outages.dead.length")
    watched.press("Pause")
    watched.until("!f.playing")
    assert_marked(watched, "dead", "r2", "1", "r2 is dead")
    told = watched.page.locator("#said .failed span").all_inner_texts()
    assert [words.partition(": ")[0] for words in told] == ["r2 is dead", "r6 lost part2"]
    said = watched.page.locator("#outages .dead").inner_text()
    assert said.startswith("r2 is dead: a spare replaces it in ")
    assert watched.page.locator("#gantt .stood.dead").count() == 1
    watched.press("Play")
    watched.until("!f.outages.dead.length")
    assert_marked(watched, "dead")
    watched.close()
    assert watched.trouble == []


def test_a_robot_is_paused_and_other_faults_are_shown(browser: Any) -> None:
    """A robot by a click; a part, what is joined, a feeder and all sensors by a list of faults."""
    faults = (
        Deviation("blackout", at=4.0, seconds=2.0),
        Deviation("no_part", label="part1", at=8.0, seconds=5.0),
        Deviation("bad_part", label="part1", at=20.0),
        Deviation("misplaced", label="part1", at=30.0),
        Deviation("bad_joint", label="sub1", at=40.0),
    )
    campaign = Campaign(faults, clear=1.0, spares=1, swap=2.0)
    watched = Watched(browser, campaign)
    watched.until("f.outages.told.some(([mark]) => mark === 'dark')")
    watched.until("f.outages.told.some(([mark]) => mark === 'empty')")
    assert "part1 is empty" in watched.page.locator("#outages .empty").inner_text()
    watched.page.locator("#gantt button[data-robot='1']").click()
    watched.press("Pause for 5 s")
    watched.until("f.outages.standing.includes('r2')")
    watched.page.locator("#speed").select_option("0")
    watched.until("f.failed === 3")
    watched.seen("n => n === 3", "document.querySelectorAll('#said .failed').length")
    messages = watched.page.locator("#said .failed span").all_inner_texts()
    words = ["sub1 does not fit", "part1 lies askew in its feeder", "part1 is no good"]
    assert [message.partition(":")[0] for message in messages] == words
    watched.close()
    assert watched.trouble == []


def test_things_are_found_by_name(watched: Watched) -> None:
    field = watched.page.locator("#find")
    field.fill("r9")
    watched.page.keyboard.press("Enter")
    assert watched.page.get_by_text("Nothing is called r9").is_visible()
    field.fill("r3")
    watched.page.keyboard.press("Enter")
    assert watched.page.locator("#chosen").inner_text() == "robot r3 ✕"
    assert watched.trouble == []


def test_it_comes_back_when_the_connection_does(watched: Watched) -> None:
    watched.until("f.count > 2")
    (connection,) = watched.server._server.connections
    connection.close()
    said = "document.getElementById('connection').textContent"
    watched.seen("words => words === 'closed'", said)
    watched.seen("words => words === 'live'", said)


def test_a_phone_shows_it_in_one_column(browser: Any) -> None:
    watched = Watched(browser, device_scale_factor=2)
    watched.page.set_viewport_size({"width": 390, "height": 800})
    watched.until("f.count > 2")
    wide = watched.page.evaluate("document.documentElement.scrollWidth")
    assert wide <= 390
    watched.close()
    assert watched.trouble == []
