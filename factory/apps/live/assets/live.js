'use strict';
// The page of a running factory: receives frames from a socket and sends commands to it.

// Where every body is in the newest frame.
class LiveMotion {
  constructor() {
    this.row = new Map(DATA.frames.moving.map((body, row) => [body, row]));
    this.poses = null;
  }

  take(poses) {
    this.poses = poses;
  }

  frame() {
    return null;
  }

  reach(body) {
    const row = this.row.get(body);
    return row === undefined ? [] : DATA.frames.reach.map((end) => end[row]);
  }

  position(body) {
    const at = this.row.get(body);
    const [x, y, z] = this.poses && at !== undefined
      ? this.poses.subarray(7 * at, 7 * at + 3)
      : DATA.frames.position[body];
    return { x, y, z, shown: z > DATA.frames.hidden };
  }

  quaternion(body) {
    const at = this.row.get(body);
    return this.poses ? this.poses.subarray(7 * at + 3, 7 * at + 7) : DATA.frames.quaternion[body];
  }
}

// The marking of the newest frame.
class LiveGame {
  constructor() {
    this.marked = new Set();
  }

  at() {
    return this.marked;
  }
}

// The length of a text, the text, and numbers.
function unpackedFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return [JSON.parse(text), new Float32Array(buffer, 4 + length)];
}

// What can be done to what is selected.
class Acts {
  constructor(panel, selection, send) {
    Object.assign(this, { panel, selection, send, slowed: {}, blocked: [], answer: document.getElementById('answer') });
    selection.listeners.push(() => this.draw());
    this.draw();
  }

  take({ slowed, blocked, pushed }) {
    this.answer.textContent = pushed;
    this.answer.hidden = !pushed;
    const same = JSON.stringify([slowed, blocked]) === JSON.stringify([this.slowed, this.blocked]);
    if (same) return;
    Object.assign(this, { slowed, blocked });
    this.draw();
    const isSlow = (robot) => String(robot) in slowed;
    document.querySelectorAll('[data-robot]').forEach((e) => e.classList.toggle('slowed', isSlow(e.dataset.robot)));
    const labels = new Set(blocked.map((label) => DATA.labels.indexOf(label)));
    document.querySelectorAll('[data-label]').forEach((e) => e.classList.toggle('blocked', labels.has(Number(e.dataset.label))));
  }

  // The robot, and the part with a feeder, of the selection.
  get meant() {
    const { chosen } = this.selection;
    if (!chosen) return {};
    const link = DATA.links[chosen.kind][chosen.number];
    const labels = chosen.kind === 'label' ? [DATA.labels[chosen.number]] : link.labels.map((n) => DATA.labels[n]);
    const robot = chosen.kind === 'robot' ? chosen.number : link.robots[0];
    return { robot, part: labels.find((label) => DATA.parts.includes(label)) };
  }

  draw() {
    const { robot, part } = this.meant;
    const made = [];
    const name = DATA.robots[robot];
    if (robot !== undefined) {
      const now = this.slowed[robot] || 1;
      made.push(this.words('h3', `Robot ${name}`));
      made.push(this.group('Push', [
        ['◂◂ back', { do: 'push', robot, share: -1 }],
        ['◂', { do: 'push', robot, share: -0.5 }],
        ['▸', { do: 'push', robot, share: 0.5 }],
        ['ahead ▸▸', { do: 'push', robot, share: 1 }],
      ]));
      made.push(this.group('Speed', [...DATA.factors].reverse().map((factor) =>
        [factor === 1 ? 'full' : `${100 * factor} %`, { do: 'slow', robot, factor }, factor === now])));
    }
    if (robot !== undefined && DATA.fails)
      made.push(this.group('Failure', [
        ['Pause for 5 s', { do: 'down', robot }],
        ['Kill', { do: 'dead', robot }],
      ]));
    if (part !== undefined) {
      const stopped = this.blocked.includes(part);
      made.push(this.words('h3', part), this.group('Feeder:', [
        ['open', { do: 'block', part, blocked: false }, !stopped],
        ['blocked', { do: 'block', part, blocked: true }, stopped],
      ]));
    }
    if (!made.length) {
      made.push(this.words('p', `Choose a robot to push it, slow it down${DATA.fails ? ', pause it or kill it' : ''}, or a part to block its feeder; here or in any view.`));
      made.push(this.choice('Robots', 'robot', DATA.robots.map((words, n) => [words, n])));
      made.push(this.choice('Feeders', 'label', DATA.parts.map((words) => [words, DATA.labels.indexOf(words)])));
    }
    const changes = [
      ...Object.entries(this.slowed).map(([n, factor]) => [`${DATA.robots[n]} at ${100 * factor} % ✕`, { do: 'slow', robot: Number(n), factor: 1 }]),
      ...this.blocked.map((label) => [`${label} blocked ✕`, { do: 'block', part: label, blocked: false }]),
    ];
    if (changes.length) {
      const group = this.group('', changes);
      group.classList.add('changes');
      made.push(group);
    }
    this.panel.replaceChildren(...made);
  }

  // Buttons that select.
  choice(name, kind, choices) {
    const group = this.group(name, []);
    for (const [words, number] of choices) {
      const button = this.words('button', words);
      button.dataset[kind] = number;
      group.append(button);
    }
    return group;
  }

  // A push goes on for as long as the button is held.
  held(button, command) {
    let timer = null;
    const end = () => clearInterval(timer);
    button.title = 'Hold to keep pushing';
    button.addEventListener('pointerdown', () => {
      end();
      this.send(command);
      timer = setInterval(() => this.send(command), 200);
    });
    ['pointerup', 'pointerleave', 'pointercancel', 'blur'].forEach((name) => button.addEventListener(name, end));
    button.addEventListener('click', (event) => event.detail || this.send(command));
  }

  words(kind, text) {
    const element = document.createElement(kind);
    element.textContent = text;
    return element;
  }

  group(name, choices) {
    const group = this.words('div', '');
    group.className = 'group';
    if (name) group.append(this.words('span', name));
    for (const [text, command, pressed] of choices) {
      const button = this.words('button', text);
      if (pressed !== undefined) button.setAttribute('aria-pressed', Boolean(pressed));
      if (command.do === 'push') this.held(button, command);
      else button.addEventListener('click', () => this.send(command));
      group.append(button);
    }
    return group;
  }
}

const LINES = 16;
const FAILURES = 4;

// The last transitions, the newest first; the last failures among them stay longer.
class Said {
  constructor(list) {
    this.list = list;
  }

  take(fired) {
    const late = fired.filter(([, event], n) => typeof event === 'string' || n >= fired.length - LINES);
    const rows = late.map(([time, event]) => {
      const row = document.createElement('li');
      const [at, name] = [document.createElement('time'), document.createElement('span')];
      at.textContent = `${time.toFixed(2)} s`;
      const fires = typeof event === 'number';
      const undone = () => `undone: ${event.map((e) => DATA.transitions[e]).join(', ')}`;
      name.textContent = fires ? DATA.transitions[event] : typeof event === 'string' ? event : undone();
      if (fires) name.dataset.transition = event;
      else name.className = 'bad';
      row.classList.toggle('failed', typeof event === 'string');
      row.append(at, name);
      return row;
    });
    this.list.prepend(...rows.reverse());
    const [failed, others] = [true, false].map((is) => [...this.list.children].filter((row) => row.classList.contains('failed') === is));
    [...failed.slice(FAILURES), ...others.slice(LINES - Math.min(failed.length, FAILURES))].forEach((row) => row.remove());
  }
}

class Live {
  constructor(selection, views) {
    Object.assign(this, { selection, views, run: -1, frame: null });
    this.motion = views.floor.motion;
    this.outages = new Outages(document.getElementById('outages'), views);
    this.acts = new Acts(document.getElementById('acts'), selection, (command) => this.send(command));
    this.said = new Said(document.getElementById('said'));
    this.play = document.getElementById('play');
    this.speed = document.getElementById('speed');
    this.play.addEventListener('click', () => this.toggle());
    this.speed.addEventListener('change', () => this.send({ do: 'speed', factor: Number(this.speed.value) }));
    document.getElementById('step').addEventListener('click', () => this.send({ do: 'step' }));
    document.getElementById('restart').addEventListener('click', () => this.send({ do: 'restart' }));
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(new URL('live', location.href.replace(/^http/, 'ws')));
    this.socket.binaryType = 'arraybuffer';
    this.socket.addEventListener('open', () => this.state('live', true));
    this.socket.addEventListener('message', ({ data }) => (typeof data === 'string' ? this.refused(data) : this.take(data)));
    this.socket.addEventListener('close', () => {
      this.state('closed', false);
      setTimeout(() => this.connect(), 1000);
    });
  }

  state(words, good) {
    const shown = document.getElementById('connection');
    shown.textContent = words;
    shown.className = `value ${good ? 'good' : 'bad'}`;
    document.getElementById('gone').hidden = good;
    document.querySelectorAll('#acts, #run').forEach((group) => { group.disabled = !good; });
  }

  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }

  refused(text) {
    this.note(JSON.parse(text).error);
  }

  toggle() {
    if (this.frame) this.send({ do: this.frame.playing ? 'pause' : 'play' });
  }

  // Everything is drawn when the browser is about to show a picture, and only the newest frame.
  take(buffer) {
    const [frame, poses] = unpackedFrame(buffer);
    if (frame.run !== this.run) {
      this.run = frame.run;
      this.views.gantt.clear();
      document.getElementById('said').replaceChildren();
    }
    this.outages.take(frame.outages);
    this.views.gantt.fire(frame.fired);
    this.said.take(frame.fired);
    this.frame = frame;
    this.motion.take(poses);
    this.views.net.game.marked = new Set(frame.marked);
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.waiting = false;
    const { time, playing, speed, pace, count, products, rhythm, note } = this.frame;
    document.getElementById('clock').textContent = `${time.toFixed(2)} s`;
    document.getElementById('pace').textContent = playing ? `${pace.toFixed(pace < 10 ? 2 : 0)} × real time` : 'paused';
    document.getElementById('fired').textContent = count;
    this.play.textContent = playing ? '❚❚' : '▶';
    this.play.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    if (document.activeElement !== this.speed) this.speed.value = String(speed);
    document.getElementById('products').textContent = products;
    document.getElementById('rhythm').textContent = rhythm ? `${rhythm.toFixed(2)} s after the one before` : products ? 'the first' : 'none yet';
    this.note(note);
    this.acts.take(this.frame);
    this.outages.draw();
    this.views.gantt.stand(this.outages.states, time);
    Object.values(this.views).forEach((view) => view.show(time));
  }

  note(words) {
    const note = document.getElementById('note');
    note.hidden = !words;
    note.textContent = words;
  }
}

async function start() {
  const selection = new Selection();
  const array = await unpacked();
  const motion = new LiveMotion();
  const views = { floor: new Floor(document.querySelector('svg.floor'), motion) };
  views.net = new Net(document.getElementById('net'), new LiveGame());
  views.gantt = new Rolling(document.getElementById('gantt'), (rows) => highlight(rows, selection.lit));
  wireSelection(selection, views);
  const live = new Live(selection, views);
  wireKeys(live, selection);
  await threeD(views, motion, array, (kind, number) => selection.choose(kind, number));
  return live;
}

// For tests, and for the curious: read only.
window.factoryView = (() => {
  let live = null;
  const ready = start().then((made) => {
    live = made;
  });
  return Object.freeze({
    ready,
    get frame() { return live.frame; },
    get has3d() { return Boolean(live.views.replay); },
    // How many zones are drawn in the 3-D view.
    get zones() { return (live.outages.discs || []).length; },
    // Where a robot is in the 3-D view [m].
    robot(number) {
      const mesh = live.views.replay.meshes.find((m) => m.userData.robot === number && m.userData.body);
      return live.views.replay.bodies[mesh.userData.body].position.toArray();
    },
  });
})();
