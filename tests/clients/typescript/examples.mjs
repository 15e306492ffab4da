// Writes every example as a typed constant: `tsc` holds each of them against the generated types.
// Usage: examples.mjs EXAMPLES > examples.ts
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

const folder = process.argv[2];
const files = readdirSync(folder).filter((file) => file.endsWith(".json"));
console.log('import type { components } from "./schema.js";\n');
console.log('type JobDocument = components["schemas"]["JobDocument"];\n');
console.log("export const examples: Record<string, JobDocument> = {");
for (const file of files) console.log(`  ${JSON.stringify(file)}: ${readFileSync(join(folder, file), "utf8").trim()},`);
console.log("};");
