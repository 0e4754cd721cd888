// When pictures get to the screen, as the browser's own compositor tells it (its trace of frames), in the page's time.

/** Notes until the result is called; that gives the times at which pictures were presented: of all (`all`), and of each "kpsa picture" that the
    page marked (`marked`; NaN where there was no picture after it). Milliseconds. */
export async function notePresented(page) {
  const events = [];
  page.on('Tracing.dataCollected', ({value}) => events.push(...value));
  await page.send('Tracing.start', {
    transferMode: 'ReportEvents', traceConfig: {excludedCategories: ['*'], includedCategories: ['blink.user_timing', 'disabled-by-default-devtools.timeline.frame']},
  });
  await page.evaluate(() => { performance.mark('kpsa begin'); });
  return async () => {
    const complete = new Promise((resolve) => page.on('Tracing.tracingComplete', resolve));
    await page.send('Tracing.end');
    await complete;
    const begin = events.find(({name}) => name === 'kpsa begin');
    const offset = begin.args.data.startTime - begin.ts / 1000, timesOf = (wanted, phase) =>
      events.filter(({name, ph}) => name === wanted && (!phase || ph === phase)).map(({ts}) => ts / 1000 + offset).sort((a, b) => a - b);
    const commits = timesOf('Commit', 'b'), all = timesOf('SubmitCompositorFrameToPresentationCompositorFrame', 'e');
    // a picture goes with the first frame that is handed over after it
    const next = (times, from) => times.find((time) => time >= from) ?? NaN;
    return {all, marked: timesOf('kpsa picture').map((time) => next(all, next(commits, time)))};
  };
}
