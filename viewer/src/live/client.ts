// Requests to the live server; each carries the token of the page's address.
import {typed, type Feed} from '../data/feed';
import {checkMeta, type BlobArray, type BlobInfo, type Meta, type Problem} from '../data/meta';

export type Values = Record<string, number>;
export type EvaluateMode = 'full' | 'accelerated' | 'both';

export interface EvaluateRequest {
  id: number;
  set: Values;
  clip: string | null;
  time: number;
  mode: EvaluateMode;
  handles?: boolean;
  drag?: DragRequest | null;
}

/** A handle, and the line on which the pointer holds it. */
export interface DragRequest {
  handle: number;
  from: readonly [number, number, number];
  along: readonly [number, number, number];
}

export interface EvaluateFacts {
  id: number;
  generation?: number;
  parts: ('accelerated' | 'full')[];
  verdict?: 'hit' | 'blend' | 'miss' | null;
  reason?: string | null;
  score?: number | null;
  full_us?: number | null;
  accelerated_us?: number | null;
  max_error?: number | null;
  rms_error?: number | null;
  values?: Values | null;
  /** What a drag made of its handle's controls. */
  dragged?: Values | null;
  /** x y z of each handle. */
  handles?: (number | null)[] | null;
  problem?: string | null;
}

export interface EvaluateAnswer {
  facts: EvaluateFacts;
  accelerated: Float32Array | null;
  full: Float32Array | null;
}

export interface Events {
  serial: number;
  generation: number;
  problems: Problem[];
}

/** What a pose file says. */
export interface Pose {
  set: Values;
  clip?: string | null;
  time?: number | null;
}

export interface Explanation {
  lines: string[];
  moved_by?: {name: string; metres: number}[];
}

/** What the server answered with a status of 400 or more. */
export class Refused extends Error {
  constructor(readonly status: number, readonly problems: Problem[]) {
    super(problems[0]?.message ?? `the server answered ${status}`);
  }
}

export class Client implements Feed {
  readonly live = true;
  private readonly token = new URLSearchParams(location.search).get('token') ?? '';

  async meta(): Promise<Meta> {
    return checkMeta(await (await this.request('/meta.json')).json());
  }

  async blob(name: string, info: BlobInfo): Promise<BlobArray> {
    return typed(await (await this.request('/blob/' + encodeURIComponent(name))).arrayBuffer(), name, info);
  }

  async field(name: string): Promise<Float32Array> {
    return new Float32Array(await (await this.request('/field/' + encodeURIComponent(name))).arrayBuffer());
  }

  async evaluate(request: EvaluateRequest, points: number): Promise<EvaluateAnswer> {
    const bytes = await (await this.request('/evaluate', JSON.stringify(request))).arrayBuffer();
    const length = new DataView(bytes).getUint32(0, true);
    const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length))) as EvaluateFacts;
    const answer: EvaluateAnswer = {facts, accelerated: null, full: null};
    let at = 4 + length + 3 & ~3;
    for (const part of facts.parts) {
      answer[part] = new Float32Array(bytes, at, points * 3);
      at += points * 12;
    }
    return answer;
  }

  async events(after: number): Promise<Events> {
    return await (await this.request('/events?after=' + after)).json() as Events;
  }

  async poseFile(text: string): Promise<Pose> {
    return await (await this.request('/pose-file', text)).json() as Pose;
  }

  async explain(vertex: number): Promise<Explanation> {
    return await (await this.request('/explain?vertex=' + vertex)).json() as Explanation;
  }

  private async request(path: string, body?: string): Promise<Response> {
    const answer = await fetch(path, {
      method: body === undefined ? 'GET' : 'POST', body, cache: 'no-store', credentials: 'omit', headers: {'X-Kpsa-Token': this.token},
    });
    if (answer.ok) return answer;
    const told = await answer.json().catch(() => null) as {problems?: Problem[]} | null;
    throw new Refused(answer.status, told?.problems ?? [{message: `${path.split('?')[0]}: the server answered ${answer.status}`}]);
  }
}
