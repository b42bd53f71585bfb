// Numbers for people.

const FOOT_M = 0.3048;
let feet = false;

export function useFeet(on) {
  feet = on;
}

export function formatLength(metres) {
  return feet ? `${(metres / FOOT_M).toFixed(3)} ft` : `${metres.toFixed(3)} m`;
}

// Of heights and the like, where a centimetre is enough.
export function formatCoarse(metres) {
  return feet ? `${(metres / FOOT_M).toFixed(1)} ft` : `${metres.toFixed(2)} m`;
}

export function formatSigma(metres) {
  if (feet) return `${((metres / FOOT_M) * 12).toPrecision(2)} in`;
  const mm = metres * 1000;
  return `${mm < 10 ? mm.toFixed(1) : mm.toFixed(0)} mm`;
}

export function formatArea(square_metres) {
  return feet
    ? `${(square_metres / FOOT_M ** 2).toFixed(0)} ft²`
    : `${square_metres.toFixed(1)} m²`;
}

export function formatShare(share) {
  return `${(100 * share).toFixed(0)} %`;
}

export function formatAngle(radians) {
  return `${((radians * 180) / Math.PI).toFixed(2)}°`;
}

export function formatCount(count) {
  return count.toLocaleString('en').replaceAll(',', '\u202f');
}

export function formatTime(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, '0')}`;
}

// A round length (1, 2 or 5 times a power of ten of the unit) of at most so many metres, for a
// scale bar, and its name.
export function roundLength(most_m) {
  const unit_m = feet ? FOOT_M : 1;
  const most = most_m / unit_m;
  const power = 10 ** Math.floor(Math.log10(most));
  const value = [5, 2, 1].find((digit) => digit * power <= most) * power;
  return { metres: value * unit_m, name: `${+value.toPrecision(1)} ${feet ? 'ft' : 'm'}` };
}
