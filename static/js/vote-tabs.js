// One tab votes at a time. Without Web Locks (plain http to another machine) nothing is held: the
// server keeps two tabs apart in any case.
// A page that is being left may still hold it.
const PATIENCE_MS = 600;

// Whether this tab may vote now; lost() is called when another tab takes over.
export function hold(name, lost, { steal = false } = {}) {
  if (!navigator.locks) return Promise.resolve(true);
  const how = steal ? { steal } : { signal: AbortSignal.timeout(PATIENCE_MS) };
  return new Promise((resolve) => {
    let isHeld = false;
    const tillTheEnd = () => {
      isHeld = true;
      resolve(true);
      return new Promise(() => {});
    };
    navigator.locks.request(name, how, tillTheEnd).catch(() => (isHeld ? lost() : resolve(false)));
  });
}
