'use strict';
// The drawings: floor plan and net, moved with the time.

// The size of the net's smallest letters, and that of the smallest ones that can be read [px].
const LETTERS = 9.5;
const LEAST = 9;

class Floor {
  constructor(svg, motion) {
    this.svg = svg;
    this.motion = motion;
    this.groups = [...svg.querySelectorAll('[data-body]')].map((group) => [group, Number(group.dataset.body)]);
  }

  show(time) {
    const frame = this.motion.frame(time);
    for (const [group, body] of this.groups) {
      const { x, y, shown } = this.motion.position(body, frame);
      group.toggleAttribute('hidden', !shown);
      if (shown) group.setAttribute('transform', `translate(${(1000 * x).toFixed(1)} ${(-1000 * y).toFixed(1)})`);
    }
  }
}

class Net {
  constructor(panel, game) {
    this.panel = panel;
    this.svg = panel.querySelector('svg');
    this.width = Number(this.svg.dataset.width);
    this.height = Number(this.svg.dataset.height);
    this.tokens = [...this.svg.querySelectorAll('[data-token]')];
    this.game = game;
    this.scale = 1;
    document.getElementById('net-in').addEventListener('click', () => this.zoom(this.scale * 1.3));
    document.getElementById('net-out').addEventListener('click', () => this.zoom(this.scale / 1.3));
    document.getElementById('net-fit').addEventListener('click', () => this.fit(0));
    this.fit(LEAST / LETTERS);
  }

  // The whole net, but no smaller than `least`.
  fit(least) {
    const tall = parseFloat(getComputedStyle(this.panel).maxHeight) - 2;
    const whole = Math.min(this.panel.clientWidth / this.width, tall / this.height);
    this.zoom(Math.min(1.2, Math.max(whole, least)));
  }

  zoom(scale) {
    const { panel } = this;
    const kept = Math.min(3, Math.max(0.08, scale));
    const [x, y] = [panel.scrollLeft + panel.clientWidth / 2, panel.scrollTop + panel.clientHeight / 2];
    this.svg.setAttribute('width', this.width * kept);
    this.svg.setAttribute('height', this.height * kept);
    this.svg.style.setProperty('--least', `${LEAST / kept}px`);
    this.svg.classList.toggle('far', kept * LETTERS < LEAST - 0.01);
    panel.scrollLeft = (x * kept) / this.scale - panel.clientWidth / 2;
    panel.scrollTop = (y * kept) / this.scale - panel.clientHeight / 2;
    this.scale = kept;
  }

  show(time) {
    const marked = this.game.at(time);
    this.tokens.forEach((token) => token.classList.toggle('on', marked.has(Number(token.dataset.token))));
  }
}
