'use strict';
// One selection for all views: {kind, number} of a robot, label, transition or place, or null.

class Selection {
  constructor() {
    this.chosen = null;
    this.listeners = [];
  }

  // Select something; what is selected already is let go.
  choose(kind, number) {
    const same = this.chosen && this.chosen.kind === kind && this.chosen.number === number;
    this.chosen = kind === null || same ? null : { kind, number };
    this.listeners.forEach((tell) => tell(this));
  }

  clear() {
    this.choose(null);
  }

  // What is highlighted with it: sets of numbers by kind; null where nothing is selected.
  get lit() {
    if (!this.chosen) return null;
    const link = DATA.links[this.chosen.kind][this.chosen.number];
    return Object.fromEntries(Object.entries(link).map(([key, numbers]) => [key, new Set(numbers)]));
  }

  get words() {
    if (!this.chosen) return '';
    const { kind, number } = this.chosen;
    if (kind === 'place' && number < DATA.operations.length) return DATA.operations[number].name;
    return `${kind === 'label' ? 'part' : kind} ${DATA[KINDS[kind]][number]}`;
  }
}

// What an element of the page stands for, or null.
function meant(element) {
  const found = element.closest('[data-operation],[data-place],[data-transition],[data-label],[data-robot]');
  if (!found) return null;
  const { operation, place, transition, label, robot } = found.dataset;
  if (operation !== undefined) return ['place', Number(operation)];
  if (place !== undefined) return ['place', Number(place)];
  if (transition !== undefined) return ['transition', Number(transition)];
  if (label !== undefined) return ['label', Number(label)];
  return ['robot', Number(robot)];
}

// Whether a body of a label is meant: a part of what is selected, or one body with that in it.
function isMeant(lit, label) {
  if (lit.solids.has(label)) return true;
  return lit.solids.size > 0 && DATA.links.label[label].solids.some((inside) => lit.labels.has(inside));
}

// Marks the elements under a root that belong to the selection.
function highlight(root, lit) {
  const marked = (key, attribute, inside = '') => {
    for (const element of root.querySelectorAll(`${inside}[data-${attribute}]`)) {
      element.classList.toggle('lit', Boolean(lit) && lit[key].has(Number(element.dataset[attribute])));
    }
  };
  marked('robots', 'robot');
  marked('labels', 'label');
  for (const element of root.querySelectorAll('.floor [data-label][data-body]')) {
    element.classList.toggle('lit', Boolean(lit) && isMeant(lit, Number(element.dataset.label)));
  }
  marked('transitions', 'transition');
  marked('places', 'place');
  marked('places', 'arc');
  marked('operations', 'operation');
}

// Scrolls a panel, and not the page, so that what is highlighted first can be seen.
function reveal(panel) {
  const first = panel.querySelector('.lit');
  if (!first) return;
  const [own, its] = [panel.getBoundingClientRect(), first.getBoundingClientRect()];
  if (its.top < own.top + 26 || its.bottom > own.bottom) panel.scrollTop += its.top - own.top - own.height / 2;
  if (its.left < own.left || its.left > own.right) panel.scrollLeft += its.left - own.left - own.width / 2;
}
