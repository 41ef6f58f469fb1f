'use strict';
// The page of a run that is over: a slider for all views.

class Clock {
  constructor() {
    this.time = 0;
    this.listeners = [];
    this.slider = document.getElementById('slider');
    this.button = document.getElementById('play');
    this.speed = document.getElementById('speed');
    this.shown = document.getElementById('clock');
    this.slider.max = DATA.end;
    this.slider.addEventListener('input', () => this.seek(Number(this.slider.value)));
    this.button.addEventListener('click', () => this.toggle());
  }

  seek(time) {
    this.time = Math.min(DATA.end, Math.max(0, time));
    this.slider.value = this.time;
    this.shown.textContent = `${this.time.toFixed(2)} s`;
    this.slider.setAttribute('aria-valuetext', `${this.time.toFixed(2)} seconds`);
    this.listeners.forEach((tell) => tell(this.time));
  }

  toggle() {
    this.playing = !this.playing;
    this.button.textContent = this.playing ? '❚❚' : '▶';
    this.button.setAttribute('aria-label', this.playing ? 'Pause' : 'Play');
    if (!this.playing) return;
    if (this.time >= DATA.end) this.seek(0);
    let before = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      this.seek(this.time + ((now - before) / 1000) * Number(this.speed.value));
      before = now;
      if (this.time >= DATA.end) this.toggle();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

function saveCertificate() {
  const text = document.getElementById('certificate').textContent;
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], { type: 'application/json' }));
  link.download = `${DATA.name}.proof.json`;
  link.click();
  URL.revokeObjectURL(link.href);
}

async function start() {
  const selection = new Selection();
  const clock = new Clock();
  const views = {};
  let array;
  try {
    array = await unpacked();
  } catch (error) {
    document.getElementById('stage-note').textContent = 'This browser is too old for the replay.';
    throw error;
  }
  const motion = new Motion(array);
  const choose = (kind, number) => selection.choose(kind, number);
  views.floor = new Floor(document.querySelector('svg.floor'), motion);
  views.net = new Net(document.getElementById('net'), new Game());
  const gantt = document.getElementById('gantt');
  views.gantt = new Gantt(gantt, (time) => clock.seek(time), (rows) => highlight(rows, selection.lit));
  wireSelection(selection, views);
  wireKeys(clock, selection);
  document.getElementById('save-certificate').addEventListener('click', saveCertificate);
  const painted = threeD(views, motion, array, choose);
  clock.listeners.push((time) => Object.values(views).forEach((view) => view.show(time)));
  clock.seek(0);
  await painted;
  return { selection, clock, views };
}

// For tests, and for the curious: read only.
window.factoryReport = (() => {
  let parts = null;
  const ready = start().then((made) => {
    parts = made;
  });
  return Object.freeze({
    ready,
    get time() { return parts.clock.time; },
    get marked() { return [...parts.views.net.game.marked].sort((a, b) => a - b); },
    get selected() { return parts.selection.chosen; },
    get has3d() { return Boolean(parts.views.replay); },
    // Where a robot is in the 3-D view [m].
    robot(number) {
      const mesh = parts.views.replay.meshes.find((m) => m.userData.robot === number && m.userData.body);
      return parts.views.replay.bodies[mesh.userData.body].position.toArray();
    },
    // A point of the window where the 3-D view shows a thing of a kind, or null.
    pixel(kind, number) {
      const { replay } = parts.views;
      const box = replay.canvas.getBoundingClientRect();
      for (let y = 4; y < box.height; y += 4)
        for (let x = 4; x < box.width; x += 4) {
          const thing = replay.at(box.left + x, box.top + y);
          if (thing && thing[kind] === number) return [box.left + x, box.top + y];
        }
      return null;
    },
    // How many things of the 3-D view are highlighted.
    get lit3d() { return parts.views.replay.meshes.filter((m) => m.userData.state === 'lit').length; },
  });
})();
