// Edges over the surface: those that were modelled, or those of triangles; to be seen on what is light and on what is dark.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {pictureOf, settled, startAfresh, startBrowser} from './support/browser.mjs';
import {makeCharacter} from './support/character.mjs';
import {makeMeta} from './support/meta.mjs';
import {contrast, difference} from './support/png.mjs';

let browser, page, complaints;

before(async () => {
  browser = await startBrowser();
  const made = makeMeta(makeCharacter());
  made.meta.meshes[0].edges = null;  // of glTF there are triangles alone
  ({page, complaints} = await browser.openReport(made));
});
after(async () => browser?.stop());

const press = async (key) => {
  await page.keyboard.press(key);
  await settled(page);
};
const paint = (value) => page.getByLabel('Colours', {exact: true}).selectOption(value).then(() => settled(page));

test('E and the button draw them and take them away', async () => {
  await startAfresh(page);
  const before = await pictureOf(page);
  await press('e');
  const drawn = await pictureOf(page), button = page.getByRole('button', {name: 'Edges'});
  assert.ok(difference(before, drawn) > 0.05);
  assert.equal(await button.getAttribute('aria-pressed'), 'true');
  assert.match(await button.getAttribute('title'), /triangles that the file has/);
  await button.click();
  await page.evaluate(() => document.activeElement?.blur());
  await page.mouse.move(2, 400);
  await settled(page);
  assert.equal(difference(before, await pictureOf(page)), 0);
});

test('they are read on light and dark surfaces, in both themes', async () => {
  await startAfresh(page);
  for (const scheme of ['light', 'dark']) {
    await page.emulateMedia({colorScheme: scheme});
    await page.waitForFunction((wanted) => document.documentElement.dataset.theme === wanted, scheme);
    for (const [mode, colours] of [['accelerated', ''], ['difference', ''], ['full', 'field:spine']]) {
      await page.evaluate((m) => window.kpsa.setMode(m), mode);
      await page.evaluate(() => window.kpsa.setFrame(13, 'bend'));
      await paint(colours);
      await page.evaluate(() => document.activeElement?.blur());
      const without = await pictureOf(page);
      await press('e');
      const found = contrast(without, await pictureOf(page));
      await press('e');
      assert.ok(found > 0.08, `${scheme}, ${mode} ${colours}: ${found}`);
    }
  }
});

test('nothing was complained of', () => assert.deepEqual(complaints, []));
