// Begins: finds out which feed the page has, and shows it.
import {makeApi, type Api} from './api';
import {App, failure} from './app';
import {loadModel} from './data/model';
import {hasReport, ReportFeed} from './data/report_feed';
import {Client} from './live/client';
import {follow} from './live/events';
import {followSystem} from './ui/theme';

declare global {
  interface Window {
    kpsa: Api;
  }
}

const errors: string[] = [];
window.addEventListener('error', (event) => errors.push(event.message));
window.addEventListener('unhandledrejection', (event) => errors.push(String(event.reason)));

let app: App | null = null;

async function begin(): Promise<void> {
  followSystem();
  const client = hasReport() ? null : new Client();
  const model = await loadModel(client ?? new ReportFeed());
  const root = document.createElement('div');
  root.className = 'app';
  document.body.append(root);
  app = new App(root);
  app.load(model, client);
  if (client) {
    void followRig(app, client, model.meta.generation ?? 0);
  }
  await new Promise((resolve) => requestAnimationFrame(resolve));
  // the rig may be replaced, and its session with it, before there is an answer
  const unanswered = (): boolean => {
    const context = app?.context;
    return !!context?.session && !context.session.answered && !context.facts.value.problem;
  };
  while (unanswered()) await new Promise((resolve) => setTimeout(resolve, 5));
}

async function followRig(shown: App, client: Client, first: number): Promise<void> {
  let generation = first, newest = first, loading = false;
  const load = async (): Promise<void> => {
    if (loading) return;
    loading = true;
    while (generation !== newest) {
      const wanted = newest;
      try {
        const model = await loadModel(client);
        generation = model.meta.generation ?? wanted;
        if (generation !== newest) newest = Math.max(newest, generation);
        shown.load(model, client);
        shown.tell('the rig was loaded again');
      } catch (error) {
        shown.tell((error as Error).message);
        break;
      }
    }
    loading = false;
  };
  await follow(client, {
    problems: (problems) => shown.problems.set(problems, problems.some((p) => p.severity !== 'warning') ? ' the last good rig goes on' : undefined),
    generation: (next) => {
      newest = next;
      if (newest !== generation) void load();
    },
    connection: (lost) => {
      document.documentElement.classList.toggle('lost', lost);
      shown.tell(lost ? 'the server does not answer' : 'the server answers again');
    },
  });
}

const ready = begin();
window.kpsa = makeApi(() => app, ready, errors);
ready.catch((error: Error) => {
  errors.push(error.message);
  document.body.append(failure(error.message));
});
