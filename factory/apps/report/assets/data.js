'use strict';
// What the page is made from: names and links as JSON, and arrays of numbers in one packed text.

const DATA = JSON.parse(document.getElementById('data').textContent);

const KINDS = { robot: 'robots', label: 'labels', transition: 'transitions', place: 'places' };

// The arrays by name. Throws where the browser cannot decompress.
async function unpacked() {
  const text = document.getElementById('packed').textContent;
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  const buffer = await new Response(stream).arrayBuffer();
  const types = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };
  return (name) => {
    const [kind, start, count] = DATA.arrays[name];
    return new types[kind](buffer, start, count);
  };
}

// Byte planes of first differences along `rows` rows, as metres (or components of quaternions).
function restored(planes, rows) {
  const count = planes.length / 4;
  const values = new Float32Array(count);
  const length = count / rows;
  for (let row = 0; row < rows; row += 1) {
    let sum = 0;
    for (let n = row * length; n < (row + 1) * length; n += 1) {
      sum += planes[n] | (planes[n + count] << 8) | (planes[n + 2 * count] << 16) | (planes[n + 3 * count] << 24);
      values[n] = sum / DATA.frames.units;
    }
  }
  return values;
}

// Where every body is at a time, relative to its parent.
class Motion {
  constructor(array) {
    this.time = array('time');
    this.place = new Map(DATA.frames.moving.map((b) => [b, restored(array(`x${b}`), 3)]));
    this.turn = new Map(DATA.frames.turning.map((b) => [b, restored(array(`q${b}`), 4)]));
  }

  // The frame at or before a time, and how far it is to the next, from 0 to 1.
  frame(time) {
    let low = 0;
    let high = this.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    const next = Math.min(low + 1, this.time.length - 1);
    const span = this.time[next] - this.time[low];
    return { low, next, share: span > 0 ? Math.min(1, Math.max(0, (time - this.time[low]) / span)) : 0 };
  }

  // The least and the greatest [x, y, z] of a body; none of one that stands still.
  reach(body) {
    const path = this.place.get(body);
    if (!path) return [];
    const n = this.time.length;
    const axes = [0, 1, 2].map((axis) => path.subarray(axis * n, (axis + 1) * n));
    return [(a, b) => Math.min(a, b), (a, b) => Math.max(a, b)].map((most) => axes.map((values) => values.reduce(most)));
  }

  // {x, y, z, shown} of a body. What appears, goes or jumps is not drawn on its way.
  position(body, { low, next, share }) {
    const found = this.place.get(body);
    if (!found) {
      const [x, y, z] = DATA.frames.position[body];
      return { x, y, z, shown: true };
    }
    const n = this.time.length;
    const from = [found[low], found[n + low], found[2 * n + low]];
    const to = [found[next], found[n + next], found[2 * n + next]];
    const jump = Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    const s = jump > 0.3 ? 0 : share;
    const [x, y, z] = from.map((value, k) => value + s * (to[k] - value));
    return { x, y, z, shown: z > DATA.frames.hidden };
  }

  // [w, x, y, z] of a body.
  quaternion(body, { low }) {
    const found = this.turn.get(body);
    if (!found) return DATA.frames.quaternion[body];
    const n = this.time.length;
    return [0, 1, 2, 3].map((k) => found[k * n + low]);
  }
}

// The token game: the marked places at a time.
class Game {
  constructor() {
    this.takes = DATA.transitions.map(() => []);
    this.gives = DATA.transitions.map(() => []);
    DATA.right.forEach((events, p) => events.forEach((e) => this.takes[e].push(p)));
    DATA.left.forEach((events, p) => events.forEach((e) => this.gives[e].push(p)));
    this.rewind();
  }

  rewind() {
    this.next = 0;
    this.marked = new Set(DATA.start);
  }

  at(time) {
    if (this.next > 0 && DATA.times[this.next - 1] > time) this.rewind();
    while (this.next < DATA.fired.length && DATA.times[this.next] <= time) {
      const event = DATA.fired[this.next];
      this.takes[event].forEach((p) => this.marked.delete(p));
      this.gives[event].forEach((p) => this.marked.add(p));
      this.next += 1;
    }
    return this.marked;
  }
}

// What a bar of an operation says: what it makes, or nothing where that does not fit. It follows a
// space of no width, after which a line may end: what is too long goes to the next line, out of sight.
function inside(bar, operation) {
  const words = document.createElement('span');
  words.textContent = DATA.operations[operation].label;
  bar.append('\u200b', words);
}
