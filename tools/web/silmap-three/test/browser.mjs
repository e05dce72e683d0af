// A browser without a window, for the tests.
import { chromium } from 'playwright-core';
import { FLAGS, browserPath } from '../../../../tests/web-page/chromium.mjs';

export const openBrowser = () => chromium.launch({
  executablePath: browserPath(),
  args: [...FLAGS, '--enable-precise-memory-info', '--js-flags=--expose-gc'],
});
