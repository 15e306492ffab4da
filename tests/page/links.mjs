// Links that were copied from the page in earlier days: they open the same room, with the same light.
import assert from "node:assert/strict";
import { inflateRawSync } from "node:zlib";

/** The bathroom as the first page shared it, without a target, and the mean that it had, in lux, with its standard error. */
const FIRST = {
  hash:
    "d=1ZLdbsIwDIXfxbczVRpo6XK5Z9gdqqrQuiUiPyhJh1iVd59CJw0hXmB3ke1z_Dn2AlYaAgEfMp68cwYQtOtlVM6CWEDLqOI8UDfQBKKqirrJBXZ6iJa8qPYJIaq7E2e83rDthpefJReMCcbeWCk" +
    "YA4RwvmXXXlEXbxfK2oRw7ysWCOqbOgPisMMaebFvEcLsR9lTyOlRO-fzw9OoqY_S9gSCFduEcJVahxe5OiH0pLSy04tsk1Lmno-5wWGBnmz0KwLHsqhahEFJQ5F8DrJiW-Gzx3uDEGgyZONqoslO8ZTry4KnFqF3OgtW" +
    "9rOyAwgYnCFAiF7aYFT8c8v_MahxnAM91mtpjuSjkvaVqk4Jn-h3_4q-RZi8GlaE34u8On--aGlzpxOp6RTXKZoqr_S-7kNZI9-1WR6iu6wbzif7RR15n5lZwcqUfgA",
  mean_lux: 210.657,
  error: 0.0841,
};

/** Opens a link of the first page in the page of today. */
export async function opensOldLinks(visitor) {
  const { page } = visitor;
  await page.goto("about:blank");
  await visitor.open(`/#${FIRST.hash}`);
  await visitor.holds(() => seen.answer && seen.current);
  await visitor.rests();
  const { draft, grid } = await visitor.state();
  const linked = JSON.parse(inflateRawSync(Buffer.from(FIRST.hash.slice(2), "base64url")));
  for (const name of ["name", "location", "time", "sky", "room", "tubes", "grids"]) assert.deepEqual(draft[name], linked[name], name);
  const { mean_lux: mean, mean_lux_standard_error: error } = grid.statistics;
  assert(Math.abs(mean - FIRST.mean_lux) <= 4 * Math.hypot(error, FIRST.error), `${mean} lx, not ${FIRST.mean_lux}`);
  await visitor.open("/");
  await page.locator("#mean").waitFor();
}
