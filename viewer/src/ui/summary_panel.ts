// What a report says, in sentences: how fast, how far off, where and when, how often, and what was skipped.
import type {Context} from '../context';
import type {NodeInfo, NodeState} from '../data/meta';
import {jointOf, rmsOfAll, worstFrame, worstVertex} from '../data/worst';
import {button, h} from './dom';
import {length, percent} from './format';

const mostNames = 24;

export function makeSummary(context: Context): HTMLElement | null {
  const {model} = context;
  if (model.live || !model.accelerated) return null;
  const parts = [howFast(context), howFarOff(context), howOften(context), whatWasSkipped(context)];
  return h('div', {class: 'summary-panel'}, ...parts.filter((part) => part !== null));
}

const section = (title: string, ...children: (HTMLElement | string)[]): HTMLElement => h('section', {}, h('h3', {}, title), ...children);
const plural = (count: number, one: string): string => `${count.toLocaleString('en-US')} ${one}${count === 1 ? '' : 's'}`;

function howFast({model}: Context): HTMLElement | null {
  const figures = model.meta.summary ?? [];
  if (!figures.length) return null;
  return section('In short', h('dl', {class: 'figures'}, ...figures.flatMap(({label, value, note}) =>
    [h('dt', {}, label), h('dd', {}, h('b', {}, value), note ? `: ${note.startsWith(`${value}: `) ? note.slice(value.length + 2) : note}` : '')])));
}

function howFarOff(context: Context): HTMLElement | null {
  const {model} = context, clips = model.meta.clips ?? [], worst = worstFrame(clips), rms = rmsOfAll(clips);
  if (!clips.some((clip) => clip.max_error)) return null;
  if (!worst) return section('How far off, where and when', h('p', {}, 'Nowhere: no point of any frame differs from the full evaluation.'));
  const {name} = clips[worst.clip], place = h('span', {}, 'a vertex');
  const show = button('Show it', () => context.store.set({playing: false, clip: worst.clip, frame: worst.frame, mode: 'difference', paint: null, vertex}), {title: 'The difference in that frame, and the vertex'});
  let vertex = -1;
  worstVertex(model, worst).then(async (found) => {
    vertex = found;
    if (found < 0) return;
    const mesh = model.meshes.find((one) => found >= one.first && found < one.first + one.count), joint = await jointOf(model, found);
    place.textContent = `vertex ${mesh ? found - mesh.first : found}${mesh ? ` of ${mesh.name}` : ''}${joint ? `, where the joint ${joint} has most weight` : ''}`;
  }).catch((error: Error) => context.tell(error.message));
  const of = model.tolerance === null ? '' : worst.metres > model.tolerance ? `, beyond the tolerance of ${length(model.tolerance, model)}` : `, within the tolerance of ${length(model.tolerance, model)}`;
  return section('How far off, where and when',
    h('p', {}, h('b', {}, `At most ${length(worst.metres, model)}`), `${of}: at `, place, `, in frame ${worst.frame} of ${name}.`),
    rms === null ? '' : h('p', {}, `Over all points and frames, RMS ${length(rms, model)}.`), h('div', {class: 'row'}, show));
}

function howOften({series}: Context): HTMLElement | null {
  const count = {hit: 0, blend: 0, miss: 0}, why = new Map<string, number>();
  for (const {verdicts, reasons} of series) {
    verdicts.forEach((verdict, frame) => {
      if (!verdict) return;
      ++count[verdict];
      if (verdict !== 'hit') why.set(reasons[frame] ?? 'no reason is known', (why.get(reasons[frame] ?? 'no reason is known') ?? 0) + 1);
    });
  }
  const all = count.hit + count.blend + count.miss;
  if (!all) return null;
  const reasons = [...why].sort((a, b) => b[1] - a[1]);
  return section('How often the stack was skipped',
    h('p', {}, h('b', {}, `${count.hit.toLocaleString('en-US')} of ${plural(all, 'frame')}`), ` (${percent(count.hit / all)}) were hits: computed without the full stack. `,
      count.miss ? `${count.miss === 1 ? 'One was a miss' : `${count.miss} were misses`}, evaluated fully. ` : 'None was a miss. ',
      count.blend ? `${count.blend === 1 ? 'One was a blend' : `${count.blend} were blends`} of both.` : ''),
    reasons.length ? h('ul', {}, ...reasons.slice(0, 8).map(([reason, times]) => h('li', {}, `${plural(times, 'frame')}: ${reason}`))) : '');
}

function whatWasSkipped(context: Context): HTMLElement | null {
  const {model} = context, nodes = model.meta.nodes ?? [];
  const of = (state: NodeState): NodeInfo[] => nodes.filter((node) => node.state === state).sort((a, b) => (b.full_us ?? 0) - (a.full_us ?? 0));
  const never = of('never run'), cues = of('cues only'), off = of('switched off');
  if (!nodes.some((node) => node.state)) return null;
  const line = (what: string, some: readonly NodeInfo[]): HTMLElement | string => !some.length ? '' : h('p', {}, h('b', {}, what), ' ', ...some.slice(0, mostNames).flatMap(({name, type}, i) => [
    i ? ', ' : '', h('button', {class: 'link', attributes: {type: 'button', title: type}, on: {click: () => {
      context.store.set({node: nodes.findIndex((node) => node.name === name)});
      context.open('graph');
    }}}, name)]), some.length > mostNames ? `, and ${some.length - mostNames} more (Graph).` : '.');
  return section('What was skipped', h('p', {}, `The graph has ${plural(nodes.length, 'node')}; ${of('kept').length.toLocaleString('en-US')} run in every frame.`),
    line(`${plural(never.length, 'node')} never ${never.length === 1 ? 'runs' : 'run'} on a hit:`, never), line(`${plural(cues.length, 'node')} ${cues.length === 1 ? 'runs' : 'run'} only for the few points that are measured:`, cues),
    line(`${plural(off.length, 'node')} ${off.length === 1 ? 'is' : 'are'} switched off in any case:`, off));
}
