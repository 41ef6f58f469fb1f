'use strict';
// What is out of order now: robots that stand or are dead, and where none may come; as marks in all
// views, and in words.

const STATES = ['standing', 'closed', 'dead'];
const ZONE = 0xe83c30;
const TAG = 0.1;

// How a robot in a state looks in the 3-D view: amber where it stands, dark where it is dead.
function looking(paint, state) {
  const made = paint.clone();
  made.color.setHex(state === 'dead' ? 0x30303a : 0x8a6420);
  made.emissive.setHex(state === 'dead' ? 0x000000 : 0xd69416);
  made.emissiveIntensity = 0.7;
  return made;
}

// A flat disc of radius 1.
function round(corners = 48) {
  const disc = new THREE.BufferGeometry();
  const rim = [...Array(corners).keys()].map((k) => (2 * Math.PI * k) / corners);
  const points = [0, 0, 0, ...rim.flatMap((angle) => [Math.cos(angle), Math.sin(angle), 0])];
  disc.setAttribute('position', new THREE.BufferAttribute(new Float32Array(points), 3));
  const faces = rim.flatMap((_, k) => [0, k + 1, ((k + 1) % corners) + 1]);
  disc.setIndex(new THREE.BufferAttribute(new Uint16Array(faces), 1));
  disc.computeVertexNormals();
  return disc;
}

class Outages {
  constructor(list, views) {
    Object.assign(this, { list, views, now: { dead: [], closed: [], standing: [], zones: [], told: [] } });
    this.drawn = '';
    ['failing', 'failing-legend'].forEach((id) => (document.getElementById(id).hidden = !DATA.fails));
  }

  // The state of each robot, by number, that does not move.
  get states() {
    return new Map(STATES.flatMap((state) => this.now[state].map((name) => [DATA.robots.indexOf(name), state])));
  }

  take(now) {
    this.now = now;
  }

  draw() {
    const { now, views } = this;
    const { replay, floor } = views;
    if (replay) {
      this.paint(replay);
      this.tag(replay);
    }
    const drawn = JSON.stringify(now);
    if (drawn === this.drawn && replay === this.replay) return;
    if (replay !== this.replay) replay.controls.addEventListener('change', () => this.tag(replay));
    Object.assign(this, { drawn, replay });
    const { states } = this;
    for (const element of document.querySelectorAll('[data-robot]')) {
      const robot = Number(element.dataset.robot);
      STATES.forEach((state) => element.classList.toggle(state, states.get(robot) === state));
    }
    this.tell();
    this.onFloor(floor.svg);
    if (replay) this.inSpace(replay);
  }

  tell() {
    this.list.replaceChildren(...this.now.told.map(([state, words]) => {
      const row = document.createElement('li');
      row.className = state;
      row.append(document.createElement('i'), words);
      return row;
    }));
    this.list.hidden = !this.now.told.length;
  }

  // Selected and faded robots look as they always do.
  paint(replay) {
    const { states } = this;
    for (const mesh of replay.meshes) {
      const { robot, shape, state: selected = 'plain' } = mesh.userData;
      if (robot === undefined || selected !== 'plain') continue;
      const plain = replay.paints.of(DATA.scene.alphas[shape], 'plain');
      const look = states.get(robot);
      const made = (plain.userData.looks ||= {});
      mesh.material = look ? (made[look] ||= looking(plain, look)) : plain;
    }
  }

  // The names of robots that do not move, over them in the 3-D view, whatever they are behind.
  tag({ camera, meshes, bodies }) {
    camera.updateMatrixWorld();
    const tags = [...this.states].map(([robot, state]) => {
      const { body } = meshes.find(({ userData }) => userData.robot === robot && userData.body).userData;
      const { x, y, z } = bodies[body].position.clone().setZ(TAG).project(camera);
      const tag = document.createElement('span');
      tag.className = state;
      tag.textContent = state === 'dead' ? `${DATA.robots[robot]} is dead` : DATA.robots[robot];
      Object.assign(tag.style, { left: `${50 + 50 * x}%`, top: `${50 - 50 * y}%` });
      tag.hidden = z > 1;
      return tag;
    });
    document.getElementById('tags').replaceChildren(...tags);
  }

  // Discs of red on the floor, of the plan and of the 3-D view.
  onFloor(svg) {
    svg.querySelectorAll('.zone').forEach((zone) => zone.remove());
    for (const [x, y, radius] of this.now.zones) {
      const zone = document.createElementNS('http://www.w3.org/2000/svg', 'circle');
      zone.setAttribute('class', 'zone');
      Object.entries({ cx: 1000 * x, cy: -1000 * y, r: 1000 * radius }).forEach(([key, v]) => zone.setAttribute(key, v.toFixed(1)));
      svg.querySelector('.static').after(zone);
    }
  }

  inSpace(replay) {
    replay.scene.remove(...(this.discs || []));
    this.red ||= new THREE.MeshStandardMaterial({ color: 0, emissive: ZONE, transparent: true, opacity: 0.4, depthWrite: false });
    this.round ||= round();
    this.discs = this.now.zones.map(([x, y, radius]) => {
      const disc = new THREE.Mesh(this.round, this.red);
      disc.position.set(x, y, 0.0015);
      disc.scale.setScalar(radius);
      return disc;
    });
    if (this.discs.length) replay.scene.add(...this.discs);
  }
}
