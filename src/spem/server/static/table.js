/** Tables as CSV. */

// A spreadsheet would run what begins with one of these as a formula, and names come from anyone.
const FORMULA = /^[=+\-@\t\r]/;

function cell(value) {
  if (value === undefined || value === null) return "";
  if (typeof value === "number") return String(value);
  const text = FORMULA.test(value) ? `'${value}` : String(value);
  return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** CSV of objects: one row each, these columns. */
export function toCsv(rows, columns) {
  return [columns, ...rows.map((row) => columns.map((key) => row[key]))].map((row) => row.map(cell).join(",") + "\r\n").join("");
}
