// Which key means what. Single keys can be switched off; arrows, Backspace, Ctrl+Z and
// Esc always work.
const ALWAYS = { ArrowLeft: "a", ArrowDown: "e", ArrowRight: "b", Backspace: "undo", Escape: "leave" };

const FIRM = { Digit1: "a_clearly", Digit2: "both_miss", Digit3: "b_clearly" };
const FIRM_ALWAYS = { ArrowLeft: "a_clearly", ArrowRight: "b_clearly" };

// The action of a key press, undefined for none; no press with a modifier is a vote, but for Shift,
// where the study asks for more: with 2 neither carries the instruction out, with a side its key is
// a clear preference.
export function actionOf(event, { keys, single_keys: areOn }) {
  const isCommand = event.ctrlKey || event.metaKey;
  if (isCommand && !event.altKey && !event.shiftKey && event.key === "z") return "undo";
  if (isCommand || event.altKey || event.isComposing || event.getModifierState("AltGraph")) return undefined;
  const always = (event.shiftKey ? FIRM_ALWAYS : ALWAYS)[event.key];
  if (always) return always;
  if (!areOn) return undefined;
  const key = event.key.toLowerCase();
  if (event.shiftKey) {
    if (FIRM[event.code]) return FIRM[event.code];
    if (keys.original.includes(key)) return "pin";
    if (/^[\p{L}\p{N}]$/u.test(key)) return undefined;
  }
  // For keyboards on which digits need Shift.
  const digit = event.shiftKey ? "" : event.code.match(/^Digit(\d)$/)?.[1];
  const named = (pressed) => Object.keys(keys).find((action) => keys[action].includes(pressed));
  return named(key) ?? named(digit);
}
