// The page: lays out the parts for a model, and again when a rig is replaced by a new version of it.
import {Vector3} from 'three';
import type {Context} from './context';
import type {Model} from './data/model';
import {noFacts, Series, Signal, type Facts} from './facts';
import type {Client} from './live/client';
import {Session} from './live/session';
import {framesOf, play} from './player';
import {showReportFrames} from './report_frames';
import {Scope, Store, type State} from './state';
import {makeControls} from './ui/controls_panel';
import {cueMarks, makeCues} from './ui/cues_panel';
import {button, h, themeColour} from './ui/dom';
import {makeGraph} from './ui/graph_panel';
import {listenToHandles} from './ui/handles';
import {makeHeader} from './ui/header';
import {Help} from './ui/help';
import {listenToKeys} from './ui/keys';
import {makeLegend} from './ui/legend';
import {makePlots} from './ui/plots_panel';
import {listenToPointer} from './ui/pointer';
import {ProblemList} from './ui/problems';
import {makeSplitter} from './ui/splitter';
import {makeStatus} from './ui/status';
import {makeSummary} from './ui/summary_panel';
import {makeTables} from './ui/tables_panel';
import {Tabs, type Panel} from './ui/tabs';
import {makeTimeline} from './ui/timeline';
import {makeToolbar} from './ui/toolbar';
import {makeVertex} from './ui/vertex_panel';
import {Viewport} from './view/viewport';

export class App {
  readonly store = new Store();
  readonly viewport: Viewport;
  readonly problems = new ProblemList();
  context: Context | null = null;
  tabs: Tabs | null = null;
  private scope = new Scope();
  private readonly header = h('header', {class: 'head'});
  private readonly stage = h('div', {class: 'stage'});
  private readonly overlay = h('div', {class: 'overlay'});
  private readonly under = h('div', {class: 'under'});
  private readonly side = h('aside', {class: 'side', attributes: {'aria-label': 'Panels'}});
  private readonly toast = h('div', {class: 'toast', attributes: {role: 'status', 'aria-live': 'polite'}});
  private help: Help | null = null;
  private toastTimer = 0;

  constructor(root: HTMLElement) {
    const main = h('main');
    this.stage.append(this.overlay);
    main.append(h('div', {class: 'left'}, this.stage, this.under), makeSplitter(main), this.side);
    root.append(this.header, main, this.toast);
    this.viewport = new Viewport(this.stage);
    const colours = (): void => this.viewport.setBackground(themeColour('--stage'));
    document.addEventListener('kpsa-theme', colours);
    colours();
  }

  tell(text: string): void {
    this.toast.textContent = text;
    this.toast.classList.add('shown');
    clearTimeout(this.toastTimer);
    this.toastTimer = window.setTimeout(() => this.toast.classList.remove('shown'), 3500);
  }

  load(model: Model, client: Client | null): void {
    const before = this.context, open = this.tabs?.current, moved = before?.session?.moved;
    this.scope.end();
    before?.session?.end();
    this.help?.element.remove();
    const scope = this.scope = new Scope();
    const view = this.viewport.setModel(model);
    this.store.set(this.firstState(model, before?.model ?? null));
    const facts = new Signal<Facts>(noFacts);
    const series = (model.meta.clips ?? []).map((_, clip) => new Series(model.meta, clip));
    const tell = (text: string): void => this.tell(text);
    const session = client ? new Session(client, model, this.store, this.viewport, facts, series, tell) : null;
    if (session && before?.session) session.compare = before.session.compare;
    const context: Context = {
      store: this.store, model, viewport: this.viewport, view, series, facts, session, scope, tell, open: (panel) => this.tabs?.open(panel),
    };
    this.context = context;
    const {marks, cueOf} = cueMarks(context);
    view.setCueMarks(marks, cueOf);

    const help = this.help = new Help(model.live, model.accelerated);
    document.body.append(help.element);
    makeHeader(this.header, context, help);
    this.overlay.replaceChildren(makeToolbar(context), makeLegend(context));
    this.under.replaceChildren(...[makeTimeline(context), makeStatus(context)].filter((part) => part !== null));
    this.layPanels(context, open ?? (session ? 'controls' : model.accelerated ? 'summary' : 'plots'));
    listenToKeys(context, help);
    listenToHandles(context, this.stage);
    listenToPointer(context, this.stage);
    play(this.store, model, scope);

    if (session) {
      if (moved) {
        const known = new Set((model.meta.controls ?? []).map((control) => control.name));
        session.moved = Object.fromEntries(Object.entries(moved).filter(([name]) => known.has(name)));
        session.touched.set(0);
      }
      scope.add(this.store.on(['clip', 'frame', 'mode'], () => session.changed()));
    } else {
      showReportFrames(context);
    }
    this.insetOf(this.overlay.firstElementChild!, scope);
    if (!before) this.viewport.fit(new Vector3(0.45, 0.16, 1));
  }

  private insetOf(toolbar: Element, scope: Scope): void {
    const measure = (): void => this.viewport.setInset(toolbar.clientHeight + 12);
    const watch = new ResizeObserver(() => requestAnimationFrame(measure));
    watch.observe(toolbar);
    scope.add(() => watch.disconnect());
    measure();
  }

  private layPanels(context: Context, first: string): void {
    const found: [string, string, HTMLElement | null][] = [
      ['summary', 'Summary', makeSummary(context)], ['controls', 'Controls', makeControls(context)], ['plots', 'Plots', makePlots(context)], ['graph', 'Graph', makeGraph(context)],
      ['cues', 'Cues', makeCues(context)], ['tables', 'Tables', makeTables(context)], ['vertex', 'Vertex', makeVertex(context)],
    ];
    const panels = found.flatMap(([id, label, element]): Panel[] => element ? [{id, label, element}] : []);
    this.tabs = new Tabs(panels, first);
    this.side.replaceChildren(this.problems.element, this.tabs.element);
  }

  private firstState(model: Model, before: Model | null): Partial<State> {
    const clips = model.meta.clips ?? [], now = this.store.now;
    const named = before ? clips.findIndex((clip) => clip.name === before.meta.clips?.[now.clip]?.name) : -1;
    const tested = Math.max(0, clips.findIndex((clip) => clip.test));
    const clip = before ? named : model.live || !clips.length ? -1 : tested;
    return {
      clip, frame: Math.max(0, Math.min(now.frame, framesOf(model, clip) - 1)), playing: false, cue: -1, node: -1, paint: null, handle: -1,
      vertex: now.vertex < model.points ? now.vertex : -1, picked: now.picked.filter((v) => v < model.points),
      mode: !model.accelerated ? 'full' : before?.accelerated ? now.mode : 'accelerated',
      errorTop: (model.tolerance ?? model.unit.metres) * 2,
    };
  }
}

/** What is shown when nothing can be. */
export function failure(message: string): HTMLElement {
  return h('div', {class: 'failure', attributes: {role: 'alert'}}, h('h1', {}, 'This page cannot be shown'), h('p', {}, message), button('Try again', () => location.reload()));
}
