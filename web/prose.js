// Sentences of the service on the page.
import { html } from "./vendor/lit-html.js";

/** A sentence whose names of fields, which stand between backticks, are code; a single backtick is itself. @param {string} text */
export function prose(text) {
  const parts = text.split("`");
  const open = parts.length % 2 ? [] : [`\`${parts.pop()}`];
  return [...parts.map((part, at) => (at % 2 ? html`<code>${part}</code>` : part)), ...open];
}
