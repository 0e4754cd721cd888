// Elements without ceremony. Texts are always set as text.

type Child = Node | string | number | null | undefined | false;
type Listeners = {[K in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[K]) => void};
type Attributes = Record<string, string | number | boolean | null | undefined>;

export interface Options {
  on?: Listeners;
  class?: string;
  attributes?: Attributes;
}

function fill<T extends Element>(element: T, attributes: Attributes | undefined, children: readonly Child[]): T {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  for (const child of children) {
    if (child !== null && child !== undefined && child !== false) element.append(typeof child === 'number' ? String(child) : child);
  }
  return element;
}

export function h<K extends keyof HTMLElementTagNameMap>(tag: K, options: Options = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (options.class) element.className = options.class;
  for (const [name, call] of Object.entries(options.on ?? {})) element.addEventListener(name, call as EventListener);
  return fill(element, options.attributes, children);
}

export function svg<K extends keyof SVGElementTagNameMap>(tag: K, attributes?: Attributes, ...children: Child[]): SVGElementTagNameMap[K] {
  return fill(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);
}

export function button(label: string, press: () => void, options: {title?: string; class?: string; pressed?: boolean} = {}): HTMLButtonElement {
  return h('button', {
    class: options.class, on: {click: press},
    attributes: {type: 'button', title: options.title, 'aria-pressed': options.pressed === undefined ? null : String(options.pressed)},
  }, label);
}

export function setPressed(element: HTMLElement, pressed: boolean): void {
  element.setAttribute('aria-pressed', String(pressed));
}

/** Calls at most once a picture. */
export function onceAFrame(call: () => void): () => void {
  let waiting = false;
  return () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      call();
    });
  };
}

/** A colour of the style sheet. */
export function themeColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
