// The line between picture and panels; dragged, or moved with arrow keys.
import {h} from './dom';

export function makeSplitter(main: HTMLElement): HTMLElement {
  let width = 480;
  const set = (wanted: number): void => {
    width = Math.round(Math.min(Math.max(300, wanted), Math.max(320, main.clientWidth - 360)));
    main.style.setProperty('--side', `${width}px`);
    splitter.setAttribute('aria-valuenow', String(width));
  };
  const splitter = h('div', {
    class: 'splitter', attributes: {role: 'separator', tabindex: 0, 'aria-orientation': 'vertical', 'aria-label': 'Width of the panels', 'aria-valuenow': width, 'aria-valuemin': 300, 'aria-valuemax': 2000},
    on: {
      pointerdown: (event) => splitter.setPointerCapture(event.pointerId),
      pointermove: (event) => { if (splitter.hasPointerCapture(event.pointerId)) set(main.getBoundingClientRect().right - event.clientX); },
      keydown: (event) => {
        const by = {ArrowLeft: 20, ArrowRight: -20}[event.key];
        if (by !== undefined) set(width + by);
      },
    },
  });
  return splitter;
}
