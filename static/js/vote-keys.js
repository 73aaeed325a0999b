// Which key means what. Single keys can be switched off; arrows, Backspace, Ctrl+Z and
// Esc always work.
const ALWAYS = { ArrowLeft: "a", ArrowDown: "e", ArrowRight: "b", Backspace: "undo", Escape: "leave" };

// The action of a key press, undefined for none; no press with a modifier is a vote, but for
// Shift+2, which says that both miss the instruction.
export function actionOf(event, { keys, single_keys: areOn }) {
  const isCommand = event.ctrlKey || event.metaKey;
  if (isCommand && !event.altKey && !event.shiftKey && event.key === "z") return "undo";
  if (isCommand || event.altKey || event.isComposing || event.getModifierState("AltGraph")) return undefined;
  if (!event.shiftKey && ALWAYS[event.key]) return ALWAYS[event.key];
  if (!areOn) return undefined;
  const key = event.key.toLowerCase();
  if (event.shiftKey) {
    if (event.code === "Digit2") return "both_miss";
    if (keys.original.includes(key)) return "pin";
    if (/^[\p{L}\p{N}]$/u.test(key)) return undefined;
  }
  // For keyboards on which digits need Shift.
  const digit = event.shiftKey ? "" : event.code.match(/^Digit(\d)$/)?.[1];
  const named = (pressed) => Object.keys(keys).find((action) => keys[action].includes(pressed));
  return named(key) ?? named(digit);
}
