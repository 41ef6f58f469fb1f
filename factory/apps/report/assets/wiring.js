'use strict';
// Puts views together that move with one time and show one selection.

function wireSelection(selection, views) {
  const chip = document.getElementById('chosen');
  selection.listeners.push(({ lit, words }) => {
    document.body.classList.toggle('selecting', Boolean(lit));
    highlight(document, lit);
    chip.hidden = !lit;
    chip.textContent = `${words} ✕`;
    ['tree', 'gantt', 'net'].forEach((id) => reveal(document.getElementById(id)));
    if (views.replay) views.replay.select(lit);
  });
  chip.addEventListener('click', () => selection.clear());
  document.querySelector('main').addEventListener('click', (event) => {
    const found = meant(event.target);
    if (found) selection.choose(...found);
  });
  const field = document.getElementById('find');
  const missing = document.getElementById('missing');
  field.addEventListener('input', () => missing.replaceChildren());
  field.addEventListener('change', () => {
    const words = field.value.trim();
    const found = called(words);
    missing.textContent = found || !words ? '' : `Nothing is called ${words}`;
    if (!found) return;
    selection.clear();
    selection.choose(...found);
    field.value = '';
  });
}

// The kind and number of what is called so, as `part sub2` or just `sub2`; undefined for nothing.
function called(words) {
  const [word, ...rest] = words.split(' ');
  const kind = word === 'part' ? 'label' : word;
  const said = Object.hasOwn(KINDS, kind) ? [[kind, rest.join(' ')]] : [];
  return [...said, ...['robot', 'label', 'transition'].map((every) => [every, words])]
    .map(([every, name]) => [every, DATA[KINDS[every]].indexOf(name)])
    .find(([, number]) => number >= 0);
}

function wireKeys(clock, selection) {
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') selection.clear();
    const typing = event.target.closest('button,input,select,summary');
    if (event.key === ' ' && !typing) {
      event.preventDefault();
      clock.toggle();
    }
  });
}

// The 3-D view and the pictures; without WebGL everything else works all the same.
async function threeD(views, motion, array, choose) {
  const note = document.getElementById('stage-note');
  try {
    views.replay = new Replay(document.getElementById('stage'), motion, array, choose);
  } catch (error) {
    note.textContent = 'This browser shows no 3-D (WebGL); everything else works without.';
    return;
  }
  note.remove();
  document.querySelectorAll('[data-camera]').forEach((button) =>
    button.addEventListener('click', () => views.replay.look(button.dataset.camera)),
  );
  await pictures(views.replay.shapes);
}
