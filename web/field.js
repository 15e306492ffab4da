// Fields of the form. What the service says of a field of the document stands below it.
import { hold } from "./live.js";
import { faultInWords, prose } from "./prose.js";
import { state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** True of a field's fault: its own, or that of a part. @param {Schemas["FieldError"]} error @param {string} field its pointer */
const isOf = ({ pointer }, field) => pointer === field || pointer.startsWith(`${field}/`);

/** Pointers of the fields in a part of the page. @param {unknown} part @returns {string[]} */
function pointersIn(part) {
  if (Array.isArray(part)) return part.flatMap(pointersIn);
  const { pointer, values } = /** @type {{ pointer?: string, values?: unknown[] }} */ (Object(part));
  return pointer === undefined ? pointersIn(values ?? []) : [pointer];
}

/** What is wrong and belongs to no field of the forms. @param {unknown} forms */
export function otherFaults(forms) {
  const { problem } = state;
  if (!problem) return nothing;
  const fields = pointersIn(forms);
  const others = (problem.errors ?? []).filter((error) => !fields.some((field) => isOf(error, field)));
  if (problem.errors?.length && !others.length)
    return html`<p class="fault" role="alert">This room cannot be computed: see the fields that are marked.</p>`;
  const told = others.map(faultInWords);
  return html`<div class="fault" role="alert">${told.length ? told : html`<p>${problem.title}: ${prose(problem.detail)}</p>`}</div>`;
}

/** How a slider's value is typed where that is no number: as what, its text, and what takes an entered one. @typedef {{ type: "date" | "time", text: string, enter: (text: string) => void }} Typed */

/** @param {string} pointer */
const idOf = (pointer) => `field${pointer.replaceAll("/", "-")}`;

/**
 * A field, which carries its pointer. It may have an id of its own, and a fault that the page found.
 * @param {string} pointer
 * @param {string} label
 * @param {(attributes: { id: string, invalid: "true" | "false", described: string }) => Drawn} control
 * @param {{ id?: string, fault?: string }} [own]
 */
function around(pointer, label, control, { id = idOf(pointer), fault = "" } = {}) {
  const told = (state.problem?.errors ?? []).filter((error) => isOf(error, pointer)).map(({ detail }) => detail);
  const wrong = fault ? [fault, ...told] : told;
  const drawn = html`<div class="field ${wrong.length ? "wrong" : ""}"><label for=${id}>${label}</label>
    ${control({ id, invalid: wrong.length ? "true" : "false", described: wrong.length ? `${id}-fault` : "" })}
    ${
      wrong.length
        ? html`<p class="fault"
      id=${`${id}-fault`}>${prose(wrong.join("; "))}</p>`
        : nothing
    }</div>`;
  return { ...drawn, pointer };
}

/**
 * A number, taken over when it is entered.
 * @param {{ pointer: string, label: string, value: number | null | undefined, step?: number, min?: number, max?: number,
 *   unit?: string, set: (value: number) => void, clear?: () => void }} of
 */
export function number({ pointer, label, value, step = 0.01, min, max, unit = "", set, clear }) {
  const take = (/** @type {Event} */ event) => {
    const { value, valueAsNumber } = /** @type {HTMLInputElement} */ (event.target);
    if (Number.isFinite(valueAsNumber)) set(valueAsNumber);
    else if (value === "") clear?.();
  };
  return around(
    pointer,
    unit ? `${label}, ${unit}` : label,
    ({ id, invalid, described }) => html`<input id=${id} type="number" step=${step} min=${min ?? nothing} max=${max ?? nothing}
    .value=${value === null || value === undefined ? "" : String(value)} aria-invalid=${invalid}
      aria-describedby=${described || nothing} placeholder=${clear ? "usual" : nothing} @change=${take}>`,
  );
}

/**
 * A slider, taken over while it moves, with its value to be typed beside it.
 * @param {{ pointer: string, label: string, value: number, step: number, min: number, max: number, unit?: string, shown?: string,
 *   typed?: Typed, set: (value: number) => void }} of
 */
export function slider({ pointer, label, value, step, min, max, unit = "", shown = `${value} ${unit}`, typed, set }) {
  const take = (/** @type {Event} */ event) => set(Number(/** @type {HTMLInputElement} */ (event.target).value));
  const number = { type: "number", text: String(value), enter: (/** @type {string} */ text) => set(Number(text)) };
  const { type, text, enter } = typed ?? number;
  const entered = (/** @type {Event} */ event) => {
    const { value } = /** @type {HTMLInputElement} */ (event.target);
    if (value) enter(value);
  };
  return around(
    pointer,
    unit ? `${label}, ${unit}` : label,
    ({ id, invalid, described }) => html`<input id=${id} class="typed" type=${type} step=${type === "number" ? "any" : nothing}
      .value=${text} aria-invalid=${invalid} aria-describedby=${described || nothing} @change=${entered}><input type="range"
      aria-label=${label} min=${min} max=${max} step=${step} .value=${String(value)} aria-valuetext=${shown} @input=${take}
      @pointerdown=${() => hold(true)} @pointerup=${() => hold(false)} @pointercancel=${() => hold(false)} @change=${() => hold(false)}>`,
  );
}

/**
 * A choice; `id` where another field has the same pointer.
 * @template {string} T
 * @param {{ pointer: string, id?: string, label: string, value: T | "", options: [T, string][], set: (value: T) => void }} of
 */
export function choice({ pointer, id, label, value, options, set }) {
  const take = (/** @type {Event} */ event) => set(/** @type {T} */ (/** @type {HTMLSelectElement} */ (event.target).value));
  return around(
    pointer,
    label,
    ({
      id,
      invalid,
      described,
    }) => html`<select id=${id} aria-invalid=${invalid} aria-describedby=${described || nothing} @change=${take}>
    ${options.map(
      ([key, words]) => html`<option value=${key} ?selected=${key === value}
      .selected=${key === value}>${words}</option>`,
    )}</select>`,
    { id },
  );
}

/**
 * A line of text, taken over when it is entered.
 * @param {{ pointer: string, label: string, value: string, set: (value: string) => void }} of
 */
export function words({ pointer, label, value, set }) {
  const take = (/** @type {Event} */ event) => set(/** @type {HTMLInputElement} */ (event.target).value);
  return around(
    pointer,
    label,
    ({ id, invalid, described }) =>
      html`<input id=${id} .value=${value} aria-invalid=${invalid} aria-describedby=${described || nothing} @change=${take}>`,
  );
}

/**
 * Lines of text, taken over when they are entered; `fault` says why they were not.
 * @param {{ pointer: string, label: string, value: string, fault?: string, set: (value: string) => void }} of
 */
export function lines({ pointer, label, value, fault, set }) {
  const take = (/** @type {Event} */ event) => set(/** @type {HTMLTextAreaElement} */ (event.target).value);
  return around(
    pointer,
    label,
    ({ id, invalid, described }) =>
      html`<textarea id=${id} rows="4" spellcheck="false" .value=${value} aria-invalid=${invalid} aria-describedby=${described || nothing} @change=${take}></textarea>`,
    { fault },
  );
}

/** A place to drop a file on, or to choose one. @param {{ accept: string, label: string, take: (file: File) => void }} of */
export function file({ accept, label, take }) {
  const dropped = (/** @type {DragEvent} */ event) => {
    event.preventDefault();
    event.stopPropagation();
    const file = event.dataTransfer?.files[0];
    if (file) take(file);
  };
  const chosen = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    const file = input.files?.[0];
    if (file) take(file);
    input.value = "";
  };
  return html`<label class="drop" @dragover=${(/** @type {DragEvent} */ event) => event.preventDefault()} @drop=${dropped}>
    <input type="file" accept=${accept} @change=${chosen}><span>${label}</span></label>`;
}
