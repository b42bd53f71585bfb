// What pointer and keys do: hovering, pinning, measuring.
import { byId } from './dom.js';
import { rowTable } from './measure.js';

const CLICK_PX = 5; // a press that moves farther is a drag

export class Pointer {
  constructor(app) {
    this.app = app;
    this.pinned = null;
    this.measuring = false;
    this.pickPoints = false;
    this.listen(app.view.canvas);
    this.listenToButtons();
    addEventListener('keydown', (event) => this.key(event));
  }

  listen(canvas) {
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerleave', () => this.hover(null));
    canvas.addEventListener('pointerdown', (event) => {
      byId('hint').hidden = true;
      this.app.panel.setOpen(false);
      this.pressed = event.isPrimary ? { x: event.clientX, y: event.clientY } : null;
    });
    canvas.addEventListener('pointerup', (event) => {
      const { pressed } = this;
      this.pressed = null;
      if (!pressed || event.button !== 0) return;
      if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) < CLICK_PX)
        this.click(event);
    });
  }

  listenToButtons() {
    const { app } = this;
    const actions = {
      space: () => app.setMode('space'),
      plan: () => app.setMode('plan'),
      measure: () => this.setMeasuring(!this.measuring),
      fit: () => app.fit(),
      theme: () => this.toggleTheme(),
      menu: () => app.panel.setOpen(!app.panel.isOpen()),
      help: () => byId('keys').showModal(),
      close: () => this.clear(),
      'pick-surfaces': () => this.setPickPoints(false),
      'pick-points': () => this.setPickPoints(true),
    };
    for (const [id, action] of Object.entries(actions)) byId(id).addEventListener('click', action);
    byId('keys').addEventListener('click', () => byId('keys').close());
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (['range', 'text'].includes(event.target.type)) return;
    const { app } = this;
    const actions = {
      1: () => app.setMode('space'),
      2: () => app.setMode('plan'),
      m: () => this.setMeasuring(!this.measuring),
      f: () => app.fit(),
      t: () => this.toggleTheme(),
      s: () => app.savePicture(),
      w: () => app.toggleLayer('walls'),
      d: () => app.toggleLayer('dense'),
      p: () => app.toggleLayer('landmarks'),
      o: () => app.toggleLayer('voxels'),
      k: () => app.toggleLayer('keyframes'),
      '?': () => byId('keys').showModal(),
      Escape: () => this.clear(),
    };
    actions[event.key]?.();
  }

  toggleTheme() {
    this.app.chooseTheme(this.app.theme === 'dark' ? 'light' : 'dark');
  }

  setMeasuring(on) {
    this.measuring = on;
    byId('measure').setAttribute('aria-pressed', String(on));
    byId('measure-bar').hidden = !on;
    byId('hint').hidden = true;
    this.clear();
  }

  setPickPoints(on) {
    this.pickPoints = on;
    byId('pick-surfaces').setAttribute('aria-checked', String(!on));
    byId('pick-points').setAttribute('aria-checked', String(on));
    this.showCard();
  }

  // At most once a frame.
  move(event) {
    if (event.pointerType === 'touch' || event.buttons !== 0) return;
    this.at = event;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.hover(this.pickAt(this.at), this.at);
    });
  }

  pickAt({ clientX, clientY }) {
    const { app } = this;
    const { left, top } = app.view.canvas.getBoundingClientRect();
    const measured = this.pickPoints ? 'points' : 'surfaces';
    const only = this.measuring ? measured : 'all';
    const pick = app.picker.pick(clientX - left, clientY - top, only);
    // Surfaces are measured by lines and planes, not by the ends of lines.
    if (pick?.type === 'line' && only !== 'points') delete pick.end;
    return pick;
  }

  hover(pick, event) {
    const { app } = this;
    const changed = keyOf(pick) !== this.hoveredKey;
    this.hoveredKey = keyOf(pick);
    app.view.canvas.style.cursor = pick ? 'pointer' : '';
    const tip = byId('tip');
    tip.hidden = !pick;
    if (changed) app.highlight(pick ?? this.pinned);
    if (!pick) return;
    if (changed) {
      const { title, rows } = app.describer.describe(pick);
      tip.replaceChildren(
        Object.assign(document.createElement('b'), { textContent: title }),
        rowTable(rows),
        ...this.picturesOf(pick),
      );
    }
    this.placeTip(tip, event);
  }

  picturesOf(pick) {
    return pick?.type === 'picture' ? [this.app.layers.pictures.element(pick.index)] : [];
  }

  placeTip(tip, { clientX, clientY }) {
    const { offsetWidth, offsetHeight } = tip;
    const x = clientX + 18 + offsetWidth > innerWidth ? clientX - 18 - offsetWidth : clientX + 18;
    const y = Math.min(clientY + 14, innerHeight - offsetHeight - 8);
    tip.style.transform = `translate(${x}px, ${y}px)`;
  }

  click(event) {
    const pick = this.pickAt(event);
    if (this.measuring && pick) this.app.measure.take(pick);
    this.pinned = pick;
    this.app.highlight(pick);
    byId('tip').hidden = true;
    this.showCard();
  }

  clear() {
    this.pinned = null;
    this.app.measure.clear();
    this.app.highlight(null);
    this.showCard();
  }

  // What is pinned, and what is measured.
  showCard() {
    const { measure, describer } = this.app;
    byId('prompt').textContent = measure.prompt(this.pickPoints ? 'point' : 'line or wall');
    const picks = this.measuring ? measure.picks : [this.pinned].filter((pick) => pick);
    const described = picks.map((pick) => describer.describe(pick));
    byId('card').hidden = picks.length === 0;
    byId('card-title').textContent = described.map(({ title }) => title).join(' to ');
    const rows = measure.result ? measure.rows() : described.flatMap(({ rows: own }) => own);
    byId('card-rows').replaceChildren(rowTable(rows), ...picks.flatMap((pick) => this.picturesOf(pick)));
  }
}

function keyOf(pick) {
  if (!pick) return '';
  return `${pick.type} ${pick.index ?? pick.plane.id}${pick.end ? ` ${pick.end.toArray()}` : ''}`;
}
