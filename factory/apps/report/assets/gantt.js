'use strict';
// What every robot does when: a row for each, a bar for each operation, a page of time at once.

const MANY_BARS = 2500;
const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600];

// The spans of all operations: {operation, unit, from, to}, in the order of their beginnings.
function spans() {
  const begun = DATA.operations.map(() => []);
  const found = [];
  const count = DATA.operations.map(() => 0);
  DATA.fired.forEach((event, n) => {
    const operation = event >> 1;
    if (event % 2 === 0) begun[operation].push(DATA.times[n]);
    else {
      const from = begun[operation].length ? begun[operation].shift() : 0;
      found.push({ operation, unit: count[operation]++, from, to: DATA.times[n] });
    }
  });
  begun.forEach((times, operation) =>
    times.forEach((from) => found.push({ operation, unit: count[operation]++, from, to: DATA.end })),
  );
  return found.sort((a, b) => a.from - b.from);
}

class Gantt {
  constructor(panel, seek, drawn) {
    this.panel = panel;
    this.seek = seek;
    this.drawn = drawn;
    this.spans = spans();
    this.rows = document.createElement('div');
    this.rows.className = 'rows';
    this.axis = this.row('axis');
    this.tracks = DATA.robots.map((name, robot) => this.robot(name, robot));
    this.cursor = document.createElement('div');
    this.cursor.className = 'cursor';
    this.rows.append(this.cursor);
    panel.append(this.rows);
    this.rows.addEventListener('click', (event) => this.clicked(event));
    document.getElementById('gantt-in').addEventListener('click', () => this.zoom(0.5));
    document.getElementById('gantt-out').addEventListener('click', () => this.zoom(2));
    const bars = this.spans.reduce((sum, s) => sum + DATA.operations[s.operation].robots.length, 0);
    this.width = DATA.end / Math.max(1, Math.ceil(bars / MANY_BARS));
    this.page = -1;
    this.time = 0;
  }

  row(style) {
    const row = document.createElement('div');
    row.className = `row ${style}`;
    const name = document.createElement(style === 'axis' ? 'div' : 'button');
    const track = document.createElement('div');
    track.className = 'track';
    row.append(name, track);
    this.rows.append(row);
    return { name, track };
  }

  robot(name, robot) {
    const row = this.row('robot');
    row.name.textContent = name;
    row.name.dataset.robot = robot;
    return row.track;
  }

  zoom(factor) {
    this.width = Math.min(DATA.end, Math.max(1, this.width * factor));
    this.page = -1;
    this.show(this.time);
  }

  show(time) {
    this.time = time;
    const pages = Math.max(1, Math.ceil(DATA.end / this.width - 1e-9));
    const page = Math.min(pages - 1, Math.floor(time / this.width));
    if (page !== this.page) this.draw(page);
    const share = (time - this.from) / this.width;
    this.cursor.style.left = `calc(64px + (100% - 78px) * ${Math.min(1, Math.max(0, share)).toFixed(5)})`;
  }

  draw(page) {
    this.page = page;
    this.from = page * this.width;
    const to = this.from + this.width;
    const percent = (t) => `${((100 * (t - this.from)) / this.width).toFixed(3)}%`;
    this.tracks.forEach((track) => track.replaceChildren());
    for (const span of this.spans) {
      if (span.from >= to) break;
      if (span.to <= this.from) continue;
      const [left, right] = [Math.max(span.from, this.from), Math.min(span.to, to)];
      const { name, robots } = DATA.operations[span.operation];
      for (const robot of robots) {
        const bar = document.createElement('div');
        bar.className = `op ${DATA.roles[robot]}${span.unit % 2 ? ' odd' : ''}`;
        bar.dataset.operation = span.operation;
        bar.style.left = percent(left);
        bar.style.width = `${((100 * (right - left)) / this.width).toFixed(3)}%`;
        bar.title = `${name}, unit ${span.unit + 1}: ${span.from.toFixed(2)} to ${span.to.toFixed(2)} s`;
        if ((right - left) / this.width > 0.02) inside(bar, span.operation);
        this.tracks[robot].append(bar);
      }
    }
    const step = STEPS.find((s) => this.width / s <= 14) || STEPS[STEPS.length - 1];
    const ticks = [];
    for (let t = Math.ceil(this.from / step - 1e-9) * step; t <= to + 1e-9; t += step) {
      const tick = document.createElement('span');
      tick.style.left = percent(t);
      tick.textContent = `${Number(t.toFixed(2))} s`;
      ticks.push(tick);
    }
    this.axis.track.replaceChildren(...ticks);
    this.drawn(this.rows);
  }

  // A click beside all bars goes to that time.
  clicked(event) {
    const track = event.target.closest('.track');
    if (!track || event.target.closest('[data-operation]')) return;
    const box = track.getBoundingClientRect();
    this.seek(this.from + (this.width * (event.clientX - box.left)) / box.width);
  }
}
