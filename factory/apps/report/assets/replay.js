'use strict';
// The 3-D replay, drawn with three.js, and the pictures of parts in the tree.

const DARK = matchMedia('(prefers-color-scheme: dark)');
const SIDE = new THREE.Vector3(...DATA.scene.view).normalize();
const ABOVE = new THREE.Vector3(0, -0.001, 1).normalize();

// Geometry of a shape, its colours linear, its normals smooth but at edges; of each corner the
// metallic share and the roughness.
function shaped(array, number) {
  const geometry = new THREE.BufferGeometry();
  const colours = Float32Array.from(array(`c${number}`), (byte) => {
    const c = byte / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
  geometry.setAttribute('position', new THREE.BufferAttribute(array(`v${number}`), 3));
  geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
  geometry.setAttribute('finish', new THREE.BufferAttribute(array(`m${number}`), 2, true));
  geometry.setIndex(new THREE.BufferAttribute(array(`f${number}`), 1));
  return THREE.toCreasedNormals(geometry, 0.6);
}

// Materials as they are, highlighted, and faded, for each degree of transparency.
class Paints {
  constructor() {
    this.made = new Map();
  }

  // A material that has the finish of its corners.
  static finished(options) {
    const made = new THREE.MeshStandardMaterial({ vertexColors: true, ...options });
    made.onBeforeCompile = (shader) => {
      shader.vertexShader = `attribute vec2 finish; varying vec2 vFinish;\n${shader.vertexShader}`
        .replace('#include <begin_vertex>', '#include <begin_vertex>\nvFinish = finish;');
      shader.fragmentShader = `varying vec2 vFinish;\n${shader.fragmentShader}`
        .replace('#include <metalnessmap_fragment>', 'float metalnessFactor = vFinish.x;')
        .replace('#include <roughnessmap_fragment>', 'float roughnessFactor = vFinish.y;');
    };
    return made;
  }

  of(alpha, state) {
    const key = `${alpha} ${state}`;
    if (!this.made.has(key)) {
      const opacity = state === 'faded' ? alpha / 2 : alpha;
      this.made.set(key, Paints.finished({
        opacity,
        transparent: opacity < 1,
        emissive: state === 'lit' ? 0xc2255c : 0x000000,
        emissiveIntensity: state === 'lit' ? 0.55 : 0,
      }));
    }
    return this.made.get(key);
  }
}

// The light of a studio, from which metals and edges have their highlights, and of a sun.
function lights(renderer, scene) {
  const studio = new THREE.PMREMGenerator(renderer);
  scene.environment = studio.fromScene(new THREE.RoomEnvironment(), 0.04).texture;
  scene.environmentIntensity = 0.62;
  scene.environmentRotation.x = Math.PI / 2;
  studio.dispose();
  renderer.toneMapping = THREE.NeutralToneMapping;
  const sun = new THREE.DirectionalLight(0xfff6ea, 2.1);
  scene.add(sun, sun.target);
  return sun;
}

function greatest(values) {
  return values.reduce((a, b) => Math.max(a, b));
}

// Puts the camera where it sees all points from a direction, as near as can be; gives what it looks
// at. In the camera's axes each edge of the picture bounds a sum or difference of two coordinates.
function frame(camera, points, direction) {
  const right = new THREE.Vector3().crossVectors(camera.up, direction).normalize();
  const up = new THREE.Vector3().crossVectors(direction, right);
  const tall = Math.tan((camera.fov * Math.PI) / 360) * 0.94;
  const fitted = (axis, slope) => {
    const most = (sign) => greatest(points.map((p) => p.dot(direction) * slope + sign * p.dot(axis)));
    const [one, other] = [most(1), most(-1)];
    return { far: (one + other) / (2 * slope), at: (one - other) / 2 };
  };
  const [down, across] = [fitted(up, tall), fitted(right, tall * camera.aspect)];
  const far = Math.max(down.far, across.far);
  const depths = points.map((p) => p.dot(direction));
  const depth = (greatest(depths) - greatest(depths.map((d) => -d))) / 2;
  const point = (ahead) =>
    new THREE.Vector3().addScaledVector(direction, ahead).addScaledVector(up, down.at).addScaledVector(right, across.at);
  const middle = point(depth);
  camera.position.copy(point(far));
  camera.near = (far - depth) / 100;
  camera.far = (far - depth) * 20;
  camera.updateProjectionMatrix();
  camera.lookAt(middle);
  return middle;
}

function corners(box) {
  const found = [];
  for (const x of [box.min.x, box.max.x])
    for (const y of [box.min.y, box.max.y])
      for (const z of [box.min.z, box.max.z]) found.push(new THREE.Vector3(x, y, z));
  return found;
}

class Replay {
  // Throws where there is no WebGL.
  constructor(stage, motion, array, choose) {
    this.stage = stage;
    this.motion = motion;
    this.paints = new Paints();
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('aria-label', '3-D replay: drag to turn, scroll to come nearer');
    stage.append(this.canvas);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(34, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.shapes = DATA.scene.alphas.map((_, number) => shaped(array, number));
    this.build();
    this.ground();
    this.control();
    this.picking(choose);
    new ResizeObserver(() => this.resize()).observe(stage);
    DARK.addEventListener('change', () => this.repaint());
    this.repaint();
    this.resize();
    this.look('overview');
  }

  // A group for each body, within that of its parent, and a mesh for each thing.
  build() {
    this.bodies = DATA.frames.position.map((place, body) => {
      const group = new THREE.Group();
      const [w, x, y, z] = DATA.frames.quaternion[body];
      group.position.set(...place);
      group.quaternion.set(x, y, z, w);
      return group;
    });
    this.bodies.forEach((group, body) => {
      const parent = DATA.frames.parents[body];
      (parent === undefined ? this.scene : this.bodies[parent]).add(group);
    });
    this.meshes = DATA.scene.things.map((thing) => {
      const mesh = new THREE.Mesh(this.shapes[thing.shape], this.paints.of(DATA.scene.alphas[thing.shape], 'plain'));
      mesh.castShadow = true;
      mesh.receiveShadow = true;
      mesh.userData = thing;
      this.bodies[thing.body].add(mesh);
      return mesh;
    });
  }

  // Everything that stands, and robots over all of their way.
  extent() {
    const found = [];
    this.scene.updateMatrixWorld(true);
    for (const mesh of this.meshes) {
      if (mesh.userData.copy) continue;
      const box = new THREE.Box3().setFromObject(mesh);
      found.push(...corners(box));
      if (mesh.userData.robot === undefined) continue;
      const here = this.bodies[mesh.userData.body].position;
      for (const end of this.motion.reach(mesh.userData.body))
        found.push(...corners(box.clone().translate(new THREE.Vector3(...end).sub(here))));
    }
    return found;
  }

  ground() {
    this.points = this.extent();
    const box = new THREE.Box3().setFromPoints(this.points);
    const [middle, size] = [box.getCenter(new THREE.Vector3()), box.getSize(new THREE.Vector3())];
    const radius = size.length() / 2;
    this.sun = lights(this.renderer, this.scene);
    this.sun.position.set(middle.x - radius * 1.6, middle.y - radius * 0.7, radius * 2.3);
    this.sun.target.position.set(middle.x, middle.y, 0);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    Object.assign(this.sun.shadow.camera, { left: -radius, right: radius, top: radius, bottom: -radius, near: 0.01, far: radius * 6 });
    this.sun.shadow.normalBias = 0.004;
    this.sun.shadow.radius = 4;
    const floor = new THREE.Mesh(new THREE.PlaneGeometry(8 * radius, 8 * radius), new THREE.ShadowMaterial({ opacity: 0.22 }));
    floor.position.set(middle.x, middle.y, -0.001);
    floor.receiveShadow = true;
    const lines = [];
    const reach = Math.ceil(3 * radius);
    for (let k = -reach; k <= reach; k += 0.5) {
      lines.push(middle.x + k, middle.y - reach, 0, middle.x + k, middle.y + reach, 0);
      lines.push(middle.x - reach, middle.y + k, 0, middle.x + reach, middle.y + k, 0);
    }
    const grid = new THREE.BufferGeometry();
    grid.setAttribute('position', new THREE.BufferAttribute(new Float32Array(lines), 3));
    this.grid = new THREE.LineSegments(grid, new THREE.LineBasicMaterial());
    this.grid.position.z = -0.002;
    this.scene.add(floor, this.grid);
  }

  // A finger scrolls the page and two turn the view; a mouse turns it.
  control() {
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.maxPolarAngle = 1.54;
    if (matchMedia('(pointer: coarse)').matches) {
      this.controls.touches = { ONE: null, TWO: THREE.TOUCH.DOLLY_ROTATE };
      this.canvas.style.touchAction = 'pan-y';
    }
    this.controls.listenToKeyEvents(this.canvas);
    this.controls.addEventListener('change', () => this.draw());
  }

  picking(choose) {
    let down = null;
    this.canvas.addEventListener('pointerdown', (event) => (down = [event.clientX, event.clientY]));
    this.canvas.addEventListener('pointerup', (event) => {
      if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 5) return;
      const thing = this.at(event.clientX, event.clientY);
      if (thing && thing.robot !== undefined) choose('robot', thing.robot);
      else if (thing && thing.label !== undefined) choose('label', thing.label);
      else choose(null);
    });
  }

  // The nearest thing under a point of the window.
  at(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const point = new THREE.Vector2((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(point, this.camera);
    const seen = this.meshes.filter((mesh) => mesh.visible && this.bodies[mesh.userData.body].visible);
    const hit = ray.intersectObjects(seen, false)[0];
    return hit ? hit.object.userData : null;
  }

  look(name) {
    this.view = name;
    this.controls.target.copy(frame(this.camera, this.points, name === 'top' ? ABOVE : SIDE));
    this.controls.update();
    this.draw();
  }

  resize() {
    const { clientWidth, clientHeight } = this.stage;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    const before = this.camera.aspect;
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    if (this.view && Math.abs(before - this.camera.aspect) > 0.01) this.look(this.view);
    else this.draw();
  }

  repaint() {
    this.scene.background = new THREE.Color(DARK.matches ? 0x2a2e34 : 0xe3e5e9);
    this.grid.material.color.set(DARK.matches ? 0x363b43 : 0xd4d5d8);
    this.draw();
  }

  show(time) {
    const frame = this.motion.frame(time);
    for (const body of DATA.frames.moving) {
      const { x, y, z, shown } = this.motion.position(body, frame);
      this.bodies[body].position.set(x, y, z);
      this.bodies[body].visible = shown;
    }
    for (const body of DATA.frames.turning) {
      const [w, x, y, z] = this.motion.quaternion(body, frame);
      this.bodies[body].quaternion.set(x, y, z, w).normalize();
    }
    this.draw();
  }

  select(lit) {
    for (const mesh of this.meshes) {
      const { shape, robot, label, copy } = mesh.userData;
      let state = 'plain';
      if (lit) {
        let meant = lit.labels.has(label);
        if (robot !== undefined) meant = lit.robots.has(robot);
        else if (copy) meant = isMeant(lit, label);
        state = meant ? 'lit' : 'faded';
      }
      mesh.material = this.paints.of(DATA.scene.alphas[shape], state);
      mesh.castShadow = state !== 'faded';
      mesh.userData.state = state;
    }
    this.draw();
  }

  // Draws once before the next picture of the browser.
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.renderer.render(this.scene, this.camera);
    });
  }
}

// Pictures of all labels, drawn one by one between other work.
async function pictures(shapes) {
  const slots = new Map([...document.querySelectorAll('[data-picture]')].map((s) => [Number(s.dataset.picture), s]));
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setSize(132, 114, false);
  const [scene, camera] = [new THREE.Scene(), new THREE.PerspectiveCamera(24, 132 / 114, 0.01, 100)];
  camera.up.set(0, 0, 1);
  lights(renderer, scene).position.set(-1, -0.8, 2);
  const paint = Paints.finished({});
  const bodies = new Map();
  for (const thing of DATA.scene.things) if (thing.copy) bodies.set(thing.label, thing);
  for (const [label, slot] of slots) {
    const group = new THREE.Group();
    for (const inside of DATA.links.label[label].solids) {
      const thing = bodies.get(inside);
      const place = DATA.scene.places[inside];
      if (!thing || !place) continue;
      const mesh = new THREE.Mesh(shapes[thing.shape], paint);
      const [w, x, y, z] = DATA.frames.quaternion[thing.body];
      mesh.position.set(...place);
      mesh.quaternion.set(x, y, z, w);
      group.add(mesh);
    }
    if (!group.children.length) continue;
    scene.add(group);
    group.updateMatrixWorld(true);
    frame(camera, corners(new THREE.Box3().setFromObject(group, true)), SIDE);
    renderer.render(scene, camera);
    const image = new Image();
    image.alt = '';
    image.src = renderer.domElement.toDataURL();
    slot.replaceChildren(image);
    scene.remove(group);
    await new Promise((done) => setTimeout(done));
  }
  renderer.dispose();
  renderer.forceContextLoss();
}
