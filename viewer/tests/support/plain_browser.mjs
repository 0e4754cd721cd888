// A browser for what is measured: it is asked to run code and nothing else. One whose requests are listened to, as tests do, needs almost twice
// as long for each of them.
import {spawn} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

export async function startPlainBrowser({width, height}) {
  const folder = mkdtempSync(join(tmpdir(), 'kpsa-viewer-'));
  const browser = spawn(process.env.CHROMIUM ?? '/usr/bin/chromium', [
    '--headless', '--no-sandbox', '--remote-debugging-pipe', `--window-size=${width},${height}`, `--user-data-dir=${join(folder, 'profile')}`, '--disable-background-networking',
    '--disable-component-update', '--disable-sync', '--no-first-run', '--no-startup-window',
  ], {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe']});
  const ended = new Promise((resolve) => browser.once('exit', resolve));

  // Messages of the DevTools protocol, each ended by a zero
  let serial = 0, text = '';
  const waiting = new Map(), listeners = new Map();
  browser.once('exit', () => { for (const {reject} of waiting.values()) reject(new Error('chromium has ended')); });
  browser.stdio[4].setEncoding('utf8').on('data', (more) => {
    const whole = (text + more).split('\0');
    text = whole.pop();
    for (const message of whole.map((one) => JSON.parse(one))) {
      if (message.method) listeners.get(message.method)?.(message.params);
      const asked = waiting.get(message.id);
      waiting.delete(message.id);
      if (message.error) asked?.reject(new Error(message.error.message));
      else asked?.resolve(message.result);
    }
  });
  const ask = (method, params, sessionId) => new Promise((resolve, reject) => {
    waiting.set(++serial, {resolve, reject});
    browser.stdio[3].write(JSON.stringify({id: serial, method, params, sessionId}) + '\0');
  });

  /** A page that is ready: what runs code in it, and the protocol. */
  const open = async (url) => {
    const {targetId} = await ask('Target.createTarget', {url: 'about:blank'}), {sessionId} = await ask('Target.attachToTarget', {targetId, flatten: true});
    const send = (method, params = {}) => ask(method, params, sessionId), on = (method, call) => listeners.set(method, call);
    const evaluate = async (code, ...words) => {
      const expression = `(${code})(...${JSON.stringify(words)})`, {result, exceptionDetails} = await send('Runtime.evaluate', {expression, awaitPromise: true, returnByValue: true});
      if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
      return result.value;
    };
    const loaded = new Promise((resolve) => on('Page.loadEventFired', resolve));
    await send('Page.enable');
    await send('Page.navigate', {url});
    await loaded;
    await evaluate(() => window.kpsa.ready.then(() => undefined));
    return {evaluate, send, on};
  };
  const write = (name, content) => {
    writeFileSync(join(folder, name), content);
    return pathToFileURL(join(folder, name)).href;
  };
  const stop = async () => {
    await ask('Browser.close').catch(() => undefined);  // it may be gone before it answers
    await ended;
    rmSync(folder, {recursive: true, force: true, maxRetries: 20, retryDelay: 100});
  };
  return {open, write, stop};
}
