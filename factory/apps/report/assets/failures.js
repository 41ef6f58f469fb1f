'use strict';
// What a page has more of a run that goes on after failures: operations that were undone are
// hatched, robots that stood have a band, and the token game goes back.

// The firings by number, each with when it was undone, if it was.
function takenBack() {
  const undone = DATA.fired.map(() => Infinity);
  for (const [after, time, events] of DATA.undone)
    for (const event of events) {
      let n = after - 1;
      while (n >= 0 && (DATA.fired[n] !== event || undone[n] < Infinity)) n -= 1;
      if (n >= 0) undone[n] = time;
    }
  return undone;
}

spans = function spansWithUndone() {
  const undone = takenBack();
  const found = [];
  const open = new Map();
  const count = DATA.operations.map(() => 0);
  DATA.fired.forEach((event, n) => {
    const operation = event >> 1;
    if (event % 2 === 0) {
      const span = { operation, unit: count[operation], from: DATA.times[n], to: DATA.end, undone: undone[n] < Infinity };
      if (span.undone) span.to = undone[n];
      else count[operation] += 1;
      open.set(operation, span);
      found.push(span);
    } else {
      const span = open.get(operation) || { operation, unit: count[operation]++, from: 0, undone: undone[n] < Infinity };
      if (!open.delete(operation)) found.push(span);
      span.to = DATA.times[n];
    }
  });
  return found.sort((a, b) => a.from - b.from);
};

const plainDraw = Gantt.prototype.draw;

Gantt.prototype.draw = function drawWithUndone(page) {
  plainDraw.call(this, page);
  const to = this.from + this.width;
  const next = this.tracks.map(() => 0);
  for (const span of this.spans.filter((s) => s.from < to && s.to > this.from))
    for (const robot of DATA.operations[span.operation].robots) {
      const bar = this.tracks[robot].children[next[robot]++];
      bar.classList.toggle('undone', span.undone);
      if (span.undone) bar.title += ', undone';
    }
  const band = (robot, name, words, start, end) => {
    const [left, right] = [Math.max(start, this.from), Math.min(end, to)];
    if (right <= left) return;
    const made = document.createElement('div');
    made.className = name;
    made.style.left = `${((100 * (left - this.from)) / this.width).toFixed(3)}%`;
    made.style.width = `${((100 * (right - left)) / this.width).toFixed(3)}%`;
    made.title = `${words}: ${start.toFixed(2)} to ${end.toFixed(2)} s`;
    this.tracks[robot].prepend(made);
  };
  DATA.stood.forEach(([start, robots], n) => {
    const end = n + 1 < DATA.stood.length ? DATA.stood[n + 1][0] : DATA.end;
    robots.forEach((robot) => band(robot, 'stood', 'stands still', start, end));
  });
  DATA.dead.forEach(([robot, start, end, then]) => band(robot, 'stood dead', `is dead${then}`, start, end ?? DATA.end));
};

Game.prototype.rewind = function rewind() {
  this.next = 0;
  this.back = 0;
  this.now = 0;
  this.tokens = DATA.places.map((_, place) => (DATA.start.includes(place) ? 1 : 0));
};

Game.prototype.at = function at(time) {
  if (time < this.now) this.rewind();
  this.now = time;
  const play = (event, sign) => {
    this.takes[event].forEach((p) => (this.tokens[p] -= sign));
    this.gives[event].forEach((p) => (this.tokens[p] += sign));
  };
  for (;;) {
    const undone = DATA.undone[this.back];
    if (undone && undone[0] <= this.next) {
      if (undone[1] > time) break;
      undone[2].forEach((event) => play(event, -1));
      this.back += 1;
    } else if (this.next < DATA.fired.length && DATA.times[this.next] <= time) {
      play(DATA.fired[this.next], 1);
      this.next += 1;
    } else break;
  }
  this.marked = new Set([...this.tokens.keys()].filter((place) => this.tokens[place] > 0));
  return this.marked;
};
