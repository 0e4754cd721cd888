// A live server as docs/viewer-data.md says, that evaluates the made-up character. `node server.mjs` runs one to look at.
import {createServer} from 'node:http';
import {readFileSync} from 'node:fs';
import {makeCharacter} from './character.mjs';
import {makeMeta} from './meta.mjs';
import {page} from './report.mjs';

export const token = 'test-token-7';

/** Coefficients of a pose. */
export function coefficientsOf(character, set, clip, time) {
  const out = new Array(character.modes).fill(0);
  const at = character.clips.findIndex((c) => c.name === clip);
  if (at >= 0) {
    const {begin, fps, frames} = character.clips[at], frame = Math.min(frames - 1, Math.max(0, Math.round((time - begin) * fps)));
    const first = at ? character.clips[0].frames : 0;
    character.rowOf(first + frame).forEach((c, k) => { out[k] = c; });
  }
  if ('bend.rotateX' in set) out[0] = set['bend.rotateX'] / 30;
  if ('twist.rotateY' in set) out[1] = set['twist.rotateY'] / 30;
  if ('squash.weight' in set) out[2] = set['squash.weight'];
  return out;
}

export async function startServer({accelerated = true, port = 0} = {}) {
  const character = makeCharacter(), {meta, arrays} = makeMeta(character, {live: true, accelerated});
  const log = [], waiting = new Set();
  let serial = 0, problems = [], inFlight = 0;
  const state = {character, meta, log, mostInFlight: 0, refused: 0, held: null};

  const [handle] = meta.handles, perDegree = 0.004;  // metres that the handle goes up
  const heldAt = (set) => [handle.position[0], handle.position[1] + perDegree * (set['bend.rotateX'] ?? 0), handle.position[2]];
  /** The value at which the handle, which goes up and down, is as near to a line as it can be. */
  const drag = ({from, along}) => {
    const gap = from.map((x, i) => x - handle.position[i]), dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
    const aa = dot(along, along), up = (gap[1] * aa - along[1] * dot(along, gap)) / (aa - along[1] ** 2) / perDegree;
    return {'bend.rotateX': Math.min(60, Math.max(-60, up))};
  };
  const evaluate = (request) => {
    const dragged = request.drag ? drag(request.drag) : null;
    Object.assign(request.set, dragged);
    const bent = request.set['bend.rotateX'] ?? 0, miss = Math.abs(bent) > 50;
    const full = Float32Array.from(character.place(coefficientsOf(character, request.set, request.clip, request.time)));
    const near = Float32Array.from(full, (x, i) => miss || i % 3 !== 2 ? x : x + 0.0009 * Math.sin(i / 300));
    const parts = request.mode === 'both' ? ['accelerated', 'full'] : [request.mode];
    const facts = {id: request.id, generation: meta.generation, parts, full_us: request.mode === 'accelerated' ? null : 640, values: {...Object.fromEntries(meta.controls.map((c) => [c.name, c.value])), ...request.set}};
    if (accelerated && request.mode !== 'full') Object.assign(facts, {verdict: miss ? 'miss' : 'hit', reason: miss ? 'bend.rotateX is outside its trained range' : '', score: miss ? 1.7 : 0.4, accelerated_us: miss ? 700 : 55});
    if (request.mode === 'both') Object.assign(facts, {max_error: miss ? 0 : 0.0009, rms_error: miss ? 0 : 0.0004});
    if (dragged) facts.dragged = dragged;
    if (request.handles) facts.handles = heldAt(request.set);
    let text = Buffer.from(JSON.stringify(facts));
    const head = Buffer.alloc(4);
    head.writeUInt32LE(text.length);
    const pad = Buffer.alloc(-(4 + text.length) & 3);
    return Buffer.concat([head, text, pad, ...parts.map((part) => Buffer.from((part === 'full' ? full : near).buffer))]);
  };

  const events = () => JSON.stringify({serial, generation: meta.generation, problems});
  const server = createServer(async (request, response) => {
    const url = new URL(request.url, 'http://127.0.0.1');
    response.setHeader('Cache-Control', 'no-store');
    const json = (text) => response.setHeader('Content-Type', 'application/json').end(text);
    const refuse = (status, message) => {
      response.statusCode = status;
      json(JSON.stringify({problems: [{message}]}));
    };
    if (url.pathname === '/' && url.searchParams.get('token') === token) return response.setHeader('Content-Type', 'text/html; charset=utf-8').end(readFileSync(page));
    log.push({path: url.pathname, token: request.headers['x-kpsa-token']});
    if (request.headers['x-kpsa-token'] !== token) {
      ++state.refused;
      return refuse(403, 'wrong token');
    }
    const chunks = [];
    for await (const chunk of request) chunks.push(chunk);
    const body = Buffer.concat(chunks).toString(), [, what, name] = url.pathname.split('/').map(decodeURIComponent);
    if (what === 'meta.json') return json(JSON.stringify(meta));
    if (what === 'blob' && arrays[name]) return response.end(Buffer.from(arrays[name].buffer));
    if (what === 'field' && name === 'spine') return response.end(Buffer.from(Float32Array.from({length: meta.points}, (_, v) => Math.min(1, character.rest[3 * v + 1])).buffer));
    if (what === 'evaluate') {
      state.mostInFlight = Math.max(state.mostInFlight, ++inFlight);
      state.last = JSON.parse(body);
      await state.held;  // a promise that a test keeps
      --inFlight;
      return response.end(evaluate(JSON.parse(body)));
    }
    if (what === 'events') {
      if (Number(url.searchParams.get('after')) !== serial) return json(events());
      const answer = () => json(events());
      waiting.add(answer);
      return setTimeout(() => { if (waiting.delete(answer)) answer(); }, 20000).unref();
    }
    if (what === 'pose-file') {
      try {
        const {clip, time, ...set} = JSON.parse(body);
        return json(JSON.stringify({set, clip, time}));
      } catch {
        return refuse(400, 'pose.json:1:1 is not JSON');
      }
    }
    if (what === 'explain') {
      const at = Number(url.searchParams.get('vertex'));
      return json(JSON.stringify({lines: [`vertex ${at} is a hit`, `bent by ${state.last.set['bend.rotateX'] ?? 0}`, 'sheet@skin: spine_2 0.8, spine_1 0.2'], moved_by: [{name: 'bend.rotateX', metres: 0.2}, {name: 'twist.rotateY', metres: 0.04}, {name: 'detail.level', metres: 0.01}]}));
    }
    refuse(404, 'there is no ' + url.pathname);
  });
  const wake = () => {
    ++serial;
    for (const answer of waiting) answer();
    waiting.clear();
  };
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  return Object.assign(state, {
    url: `http://127.0.0.1:${server.address().port}/?token=${token}`,
    setProblems: (next) => { problems = next; wake(); },
    reload: (change) => { Object.assign(meta, change); ++meta.generation; wake(); },
    stop: () => { server.closeAllConnections(); return new Promise((resolve) => server.close(resolve)); },
  });
}

if (process.argv[1] === new URL(import.meta.url).pathname) console.log((await startServer({port: Number(process.argv[2] ?? 8737)})).url);
