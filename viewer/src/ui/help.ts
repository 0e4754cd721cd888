// The overlay with the keys.
import {button, h} from './dom';

const keys: readonly (readonly [string, string])[] = [
  ['Space', 'play, pause'], ['← →', 'one frame back, on (Ctrl: ten)'], ['Home, End', 'first, last frame'], ['[ ]', 'previous, next clip'], ['L', 'loop'],
  ['1 2 3 4', 'full, accelerated, difference, overlay'], ['F', 'fit'], ['Shift + arrows', 'turn'], ['+ −', 'nearer, farther'], ['X Y Z', 'from the side, above, the front'],
  ['C', 'cues'], ['E', 'edges'], ['Ctrl+Z', 'undo (Shift: redo)'], ['H', 'handles'], ['P', 'pick vertices'], ['T', 'dark or light'], ['Esc', 'nothing selected'], ['?', 'this list'],
];

export class Help {
  readonly element: HTMLDialogElement;

  constructor(live: boolean, accelerated: boolean) {
    this.element = h('dialog', {class: 'help', attributes: {'aria-label': 'Keys'}},
      h('h2', {}, 'Keys'),
      h('dl', {}, ...keys.filter(([key]) => (accelerated || key !== '1 2 3 4') && (live || (key !== 'H' && key !== 'Ctrl+Z'))).flatMap(([key, what]) => [h('dt', {}, ...key.split(' ').flatMap((k, i) => [i ? ' ' : '', /^[+,]$/.test(k) && key !== '+ −' ? k : h('kbd', {}, k.replace(',', ''))])), h('dd', {}, what)])),
      h('p', {class: 'note'}, 'Drag turns, right drag or Shift and drag moves, the wheel zooms. A click chooses a vertex. ',
        live ? 'A handle that is dragged turns or moves its node; Esc takes the drag back, a double click goes to the default. So does a double click on a slider, and Delete.' : 'This page has all its data inside and never asks a network.'),
      button('Close', () => this.element.close()));
    this.element.addEventListener('click', (event) => { if (event.target === this.element) this.element.close(); });
  }

  toggle(): void {
    if (this.element.open) this.element.close();
    else this.element.showModal();
  }
}
