// One chromium without a screen, and pages of it that note whatever goes wrong.
import {chromium} from 'playwright-core';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {makeReport} from './report.mjs';

/** Waits until nothing is asked for and all that has been done is drawn. */
export const settled = (page) => page.evaluate(() => window.kpsa.setMode(window.kpsa.state.mode));

export const pictureOf = (page) => page.locator('.stage canvas').screenshot();
export const stateOf = (page) => page.evaluate(() => ({...window.kpsa.state}));
/** A report of the made-up character as it is at first. */
export async function startAfresh(page) {
  await page.keyboard.press('Escape');
  await page.evaluate(async () => {
    await window.kpsa.setMode('accelerated');
    await window.kpsa.setFrame(0, 'bend');
    document.activeElement?.blur();
  });
}

/** `touch`: a telephone, whose pointer is a finger. */
export async function startBrowser({width = 1440, height = 900, dark = true, touch = false} = {}) {
  const folder = mkdtempSync(join(tmpdir(), 'kpsa-viewer-'));
  const context = await chromium.launchPersistentContext(join(folder, 'profile'), {
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', headless: true, viewport: {width, height}, colorScheme: dark ? 'dark' : 'light', hasTouch: touch, isMobile: touch,
    args: ['--headless', '--no-sandbox', '--disable-background-networking', '--disable-component-update', '--disable-sync', '--no-first-run'],
  });
  /** A page, its requests and its complaints. */
  const open = async (url) => {
    const page = await context.newPage(), requests = [], complaints = [];
    page.on('request', (request) => requests.push(request.url()));
    page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) complaints.push(message.text()); });
    page.on('pageerror', (error) => complaints.push(String(error)));
    page.setDefaultTimeout(120000);
    await page.goto(url);
    await page.waitForFunction(() => window.kpsa);
    await page.evaluate(() => window.kpsa.ready);
    return {page, requests, complaints};
  };
  const write = (name, text) => {
    const path = join(folder, name);
    writeFileSync(path, text);
    return 'file://' + path;
  };
  /** A page of a report of {meta, arrays}. */
  const openReport = (made, name = 'report.html') => open(write(name, makeReport(made)));
  const stop = async () => {
    await context.close();
    rmSync(folder, {recursive: true, force: true});
  };
  return {open, openReport, write, stop, folder};
}
