// Sentences of the service on the page.
import { placeInWords, placesInWords } from "./places.js";
import { html } from "./vendor/lit-html.js";

/** A sentence with its places in words, whose names of fields, which stand between backticks, are code; a single backtick is itself. @param {string} text */
export function prose(text) {
  const parts = placesInWords(text).split("`");
  const open = parts.length % 2 ? [] : [`\`${parts.pop()}`];
  return [...parts.map((part, at) => (at % 2 ? html`<code>${part}</code>` : part)), ...open];
}

/** A fault of a field: where it is, and what is wrong. @param {Schemas["FieldError"]} fault */
export function faultInWords({ pointer, detail }) {
  const place = placeInWords(pointer);
  return html`<p><strong>${place.charAt(0).toUpperCase()}${place.slice(1)}:</strong> ${prose(detail)}</p>`;
}
