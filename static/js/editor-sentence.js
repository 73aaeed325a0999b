// The sentence that the drawing makes stands in its field until somebody types another; an empty
// one is sent for it, since the server makes it anew from what it keeps.
export function makeSentence(form) {
  const { instruction } = form.elements;
  if (!instruction) return () => {};
  let isMade = instruction.value === "";
  let made = "";
  instruction.addEventListener("input", () => {
    isMade = ["", made].includes(instruction.value.trim());
  });
  form.addEventListener("formdata", ({ formData }) => {
    if (isMade) formData.set("instruction", "");
  });
  return (sentence) => {
    if (isMade && document.activeElement !== instruction) instruction.value = made = sentence;
  };
}
