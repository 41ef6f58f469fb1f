'use strict';
// What every robot does now, and has done in the last seconds: bars that move to the left.

const WINDOWS = [5, 10, 20, 40, 80, 160];

class Rolling {
  constructor(panel, drawn) {
    this.panel = panel;
    this.drawn = drawn;
    this.rows = document.createElement('div');
    this.rows.className = 'rows rolling';
    this.axis = this.row(document.createElement('div'), 'axis');
    this.tracks = DATA.robots.map((name, robot) => {
      const button = document.createElement('button');
      button.textContent = name;
      button.dataset.robot = robot;
      return this.row(button, '');
    });
    panel.append(this.rows);
    this.window = 20;
    document.getElementById('gantt-in').addEventListener('click', () => this.zoom(-1));
    document.getElementById('gantt-out').addEventListener('click', () => this.zoom(1));
    this.clear();
  }

  row(name, style) {
    const row = document.createElement('div');
    row.className = `row ${style}`;
    const track = document.createElement('div');
    track.className = 'track';
    const strip = document.createElement('div');
    strip.className = 'strip';
    track.append(strip);
    row.append(name, track);
    this.rows.append(row);
    return strip;
  }

  clear() {
    this.bars = [];
    this.open = new Map();
    this.units = DATA.operations.map(() => 0);
    this.ticks = [];
    [this.axis, ...this.tracks].forEach((strip) => strip.replaceChildren());
  }

  zoom(by) {
    const at = WINDOWS.indexOf(this.window) + by;
    this.window = WINDOWS[Math.min(WINDOWS.length - 1, Math.max(0, at))];
    this.ticks.forEach((tick) => tick.element.remove());
    this.ticks = [];
    this.bars.forEach((bar) => this.place(bar));
    this.show(this.now);
  }

  // What has fired and was undone: [[time, event], ...], with what failed, in words. `open` are the operations under way.
  fire(fired) {
    for (const [time, event] of fired.filter(([, told]) => typeof told !== 'string')) {
      if (Array.isArray(event)) {
        this.undo(event, time);
        continue;
      }
      const operation = event >> 1;
      if (event % 2 === 0) this.begin(operation, time);
      else this.end(operation, time);
    }
  }

  // Transitions that were undone: operations end where they are, or were over, and are hatched.
  undo(events, time) {
    for (const event of events.filter((e) => e % 2 === 0)) {
      const operation = event >> 1;
      const bar = [...this.bars].reverse().find((b) => b.operation === operation && !b.undone);
      this.end(operation, time);
      this.units[operation] -= 1;
      if (!bar) continue;
      bar.undone = true;
      bar.elements.forEach((element) => {
        element.classList.add('undone');
        element.title += ', undone';
      });
    }
  }

  begin(operation, time) {
    const { name, robots } = DATA.operations[operation];
    const odd = this.units[operation]++ % 2 ? ' odd' : '';
    const elements = robots.map((robot) => {
      const element = document.createElement('div');
      element.className = `op ${DATA.roles[robot]}${odd}`;
      element.dataset.operation = operation;
      element.title = name;
      inside(element, operation);
      this.tracks[robot].append(element);
      return element;
    });
    this.keep(operation, { operation, from: time, to: null, elements });
    this.fresh = true;
  }

  keep(key, bar) {
    this.bars.push(bar);
    this.open.set(key, bar);
    this.place(bar);
  }

  end(key, time) {
    const bar = this.open.get(key);
    if (!bar) return;
    bar.to = time;
    bar.elements.forEach((element) => (element.title += `, ${bar.from.toFixed(2)} to ${time.toFixed(2)} s`));
    this.open.delete(key);
    this.place(bar);
  }

  // From now on robots are in these states, by number, and in no others: bands behind the bars.
  stand(states, now) {
    DATA.robots.forEach((_, robot) => {
      const [key, state] = [`robot ${robot}`, states.get(robot)];
      const band = this.open.get(key);
      if (band && band.state === state) return;
      this.end(key, now);
      if (!state) return;
      const element = document.createElement('div');
      element.className = `stood ${state}`;
      element.title = state === 'dead' ? 'is dead' : 'stands still';
      this.tracks[robot].prepend(element);
      this.keep(key, { state, from: now, to: null, elements: [element] });
    });
  }

  // Strips are as wide as the track and move to the left by what time has gone by.
  place({ from, to, elements }) {
    for (const { style } of elements) {
      style.left = `${((100 * from) / this.window).toFixed(3)}%`;
      if (to !== null) style.width = `${((100 * (to - from)) / this.window).toFixed(3)}%`;
    }
  }

  show(now) {
    this.now = now;
    const first = now - this.window;
    for (const { from, elements } of this.open.values())
      for (const { style } of elements) style.width = `${((100 * (now - from)) / this.window).toFixed(3)}%`;
    const gone = this.bars.filter((bar) => bar.to !== null && bar.to < first);
    gone.forEach((bar) => bar.elements.forEach((element) => element.remove()));
    if (gone.length) this.bars = this.bars.filter((bar) => bar.to === null || bar.to >= first);
    this.mark(first, now);
    const moved = `translateX(${((-100 * first) / this.window).toFixed(3)}%)`;
    [this.axis, ...this.tracks].forEach((strip) => (strip.style.transform = moved));
    if (this.fresh) this.drawn(this.rows);
    this.fresh = false;
  }

  mark(first, now) {
    const step = this.window / 10;
    this.ticks = this.ticks.filter((tick) => tick.time > first || (tick.element.remove(), false));
    const last = this.ticks.length ? this.ticks[this.ticks.length - 1].time : Math.max(0, first);
    for (let t = (Math.floor(last / step + 1e-6) + 1) * step; t <= now; t += step) {
      const element = document.createElement('span');
      element.style.left = `${((100 * t) / this.window).toFixed(3)}%`;
      element.textContent = `${Number(t.toFixed(1))} s`;
      this.axis.append(element);
      this.ticks.push({ time: t, element });
    }
  }
}
