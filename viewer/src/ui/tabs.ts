// Panels of which one is shown, as the ARIA pattern for tabs asks.
import {h} from './dom';

export interface Panel {
  id: string;
  label: string;
  element: HTMLElement;
}

export class Tabs {
  readonly element: HTMLElement;
  private readonly tabs: HTMLButtonElement[];
  current = '';

  constructor(private readonly panels: readonly Panel[], first: string) {
    this.tabs = panels.map((panel, i) => h('button', {
      attributes: {type: 'button', role: 'tab', id: `tab-${panel.id}`, 'aria-controls': `panel-${panel.id}`},
      on: {
        click: () => this.open(panel.id),
        keydown: (event) => {
          const by = {ArrowLeft: -1, ArrowRight: 1}[event.key];
          if (by === undefined) return;
          const next = (i + by + panels.length) % panels.length;
          this.open(panels[next].id);
          this.tabs[next].focus();
          event.preventDefault();
        },
      },
    }, panel.label));
    this.element = h('div', {class: 'tabs'}, h('div', {class: 'tab-row', attributes: {role: 'tablist', 'aria-label': 'Panels'}}, ...this.tabs),
      ...panels.map((panel) => {
        panel.element.classList.add('panel');
        panel.element.id = `panel-${panel.id}`;
        panel.element.setAttribute('role', 'tabpanel');
        panel.element.setAttribute('aria-labelledby', `tab-${panel.id}`);
        return panel.element;
      }));
    this.open(panels.some((p) => p.id === first) ? first : panels[0]?.id ?? '');
  }

  open(id: string): void {
    if (!this.panels.some((panel) => panel.id === id)) return;
    this.current = id;
    this.panels.forEach((panel, i) => {
      const open = panel.id === id;
      panel.element.hidden = !open;
      this.tabs[i].setAttribute('aria-selected', String(open));
      this.tabs[i].tabIndex = open ? 0 : -1;
    });
  }
}
