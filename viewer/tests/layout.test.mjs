// Sizes, themes and the way through by Tab.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {settled, startBrowser} from './support/browser.mjs';
import {makeCharacter} from './support/character.mjs';
import {makeMeta} from './support/meta.mjs';

let browser, page;

before(async () => {
  browser = await startBrowser();
  ({page} = await browser.openReport(makeMeta(makeCharacter())));
});
after(async () => browser?.stop());

/** Visible controls that stick out of the window to the side, or whose text is cut. */
const faults = () => page.evaluate(() => {
  const found = [];
  if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} wide`);
  for (const element of document.querySelectorAll('button, select, input, h1, h3, .legend, .status, .summary')) {
    if (!element.checkVisibility() || element.closest('.table-place, .tab-row, .bars')) continue;
    const box = element.getBoundingClientRect();
    if (box.width && (box.left < -1 || box.right > innerWidth + 1)) found.push(`${element.tagName}.${element.className} ${element.textContent.slice(0, 20)}`);
    if (element.tagName === 'BUTTON' && element.scrollWidth > element.clientWidth + 1) found.push(`cut: ${element.textContent}`);
  }
  return found;
});

for (const [width, height] of [[1440, 900], [1024, 700], [420, 800]]) {
  test(`nothing sticks out at ${width} x ${height}`, async () => {
    await page.setViewportSize({width, height});
    await page.evaluate(() => window.kpsa.setMode('difference'));
    for (const tab of await page.getByRole('tab').all()) {
      await tab.click();
      await settled(page);
      assert.deepEqual(await faults(), [], await tab.innerText());
    }
    const stage = await page.locator('.stage canvas').boundingBox(), side = await page.locator('.side').boundingBox();
    assert.ok(stage.width > 250 && stage.height > 250);
    if (width < 820) assert.ok(side.y >= stage.y + stage.height, 'panels are below the picture');
    else assert.ok(side.x >= stage.x + stage.width - 1, 'panels are beside the picture');
  });
}

test('the overlays do not cover each other', async () => {
  await page.setViewportSize({width: 1440, height: 900});
  const [toolbar, legend] = await Promise.all([page.locator('.toolbar').boundingBox(), page.locator('.legend').boundingBox()]);
  assert.ok(toolbar.y + toolbar.height <= legend.y);
});

test('dark and light follow the system, and are readable', async () => {
  const contrast = () => page.evaluate(() => {
    const light = (text) => {
      const [r, g, b] = text.match(/[\d.]+/g).map((x) => (Number(x) / 255 <= 0.04045 ? Number(x) / 255 / 12.92 : ((Number(x) / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const probe = document.body.appendChild(document.createElement('i')), colour = (name) => {
      probe.style.color = `var(${name})`;
      return light(getComputedStyle(probe).color);
    };
    const pairs = [['--ink', '--ground'], ['--muted', '--ground'], ['--muted', '--raised'], ['--ink', '--control'], ['--accent-ink', '--accent'], ['--node-ink', '--state-kept'],
      ['--node-ink', '--state-cues'], ['--node-ink', '--state-never'], ['--bad', '--raised']];
    const result = pairs.map(([a, b]) => {
      const [x, y] = [colour(a), colour(b)].sort((p, q) => q - p);
      return [`${a} on ${b}`, (x + 0.05) / (y + 0.05)];
    });
    probe.remove();
    return result;
  });
  for (const scheme of ['light', 'dark']) {
    await page.emulateMedia({colorScheme: scheme});
    await page.waitForFunction((wanted) => document.documentElement.dataset.theme === wanted, scheme);
    for (const [pair, ratio] of await contrast()) assert.ok(ratio >= 4.5, `${scheme}: ${pair} ${ratio.toFixed(2)}`);
  }
});

test('everything is reached by Tab', async () => {
  await page.setViewportSize({width: 1440, height: 900});
  await page.evaluate(() => document.activeElement?.blur());
  const seen = new Set();
  for (let i = 0; i < 60; ++i) {
    await page.keyboard.press('Tab');
    seen.add(await page.evaluate(() => document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent));
  }
  for (const name of ['Full', 'Accelerated', 'Difference', 'Overlay', 'Colours', 'Cues', 'Fit', 'Play', 'Frame', 'Clip', 'Keys', 'Vertex', 'Width of the panels']) {
    assert.ok([...seen].some((text) => text.startsWith(name)), `${name}: ${[...seen].join(' | ')}`);
  }
});

test('every control has a name', async () => {
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, select, input, textarea, canvas[role], [role=tab]')]
    .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label'))).map((e) => e.outerHTML.slice(0, 80)));
  assert.deepEqual(nameless, []);
});

test('on a telephone nothing sticks out, and a finger finds what it presses', async () => {
  const phone = await startBrowser({width: 390, height: 844, touch: true});
  try {
    const {page: small} = await phone.openReport(makeMeta(makeCharacter()), 'phone.html');
    await small.evaluate(() => window.kpsa.setMode('difference'));
    for (const tab of await small.getByRole('tab').all()) {
      await tab.tap();
      await settled(small);
      const found = await small.evaluate(() => {
        const faults = document.documentElement.scrollWidth > innerWidth ? [`the page is ${document.documentElement.scrollWidth} wide`] : [];
        for (const element of document.querySelectorAll('button, select, input[type=range], input[type=search], input[type=number]')) {
          const {width, height} = element.getBoundingClientRect();
          if (element.checkVisibility() && width && height < (element.matches('.link, th button, .bars button') ? 30 : 34)) faults.push(`${element.outerHTML.slice(0, 80)} is ${height} high`);
        }
        return faults;
      });
      assert.deepEqual(found, [], await tab.innerText());
    }
  } finally {
    await phone.stop();
  }
});
