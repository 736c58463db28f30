// By what the samples are sorted: their index, or how much pictures, metrics and detected objects differ between twins.
const MOST_METRICS = 4; // of each evaluation; results.json has all
const [FIRST_DATASET, ...OTHER_DATASETS] = ABOUT.datasets;
const joined = (...parts) => parts.filter(Boolean).join(" · ");
const SORTS = [...pictureSorts(), ...objectSorts(), ...metricSorts()];


function pictureSorts() {
  return OTHER_DATASETS.filter((name) => SAMPLES.some((sample) => isNumber(sample.compared.pictures[name]))).map((name) => ({
    key: `pictures~${name}`, group: "Pictures", label: `Picture change · ${name}`, digits: 4, of: (sample) => sample.compared.pictures[name],
  }));
}

function objectSorts() {
  const pairs = new Map();
  for (const { evaluation, dataset, against } of SAMPLES.flatMap((sample) => sample.compared.objects)) pairs.set(`${evaluation}~${dataset}~${against}`, { evaluation, dataset, against });
  return [...pairs].map(([key, pair]) => ({
    key: `objects~${key}`, group: "Objects", label: `Changed objects · ${pair.dataset} against ${pair.against} · ${pair.evaluation}`, digits: 0,
    of: (sample) => sample.compared.objects.filter((one) => one.evaluation === pair.evaluation && one.dataset === pair.dataset && one.against === pair.against).length,
  }));
}

function metricSorts() {
  return ABOUT.evaluations.flatMap((evaluation) => {
    const value = (sample, dataset, name) => sample.compared.metrics[evaluation]?.[dataset]?.[name];
    const names = [...new Set(SAMPLES.flatMap((sample) => Object.values(sample.compared.metrics[evaluation] ?? {}).flatMap(Object.keys)))].slice(0, MOST_METRICS);
    const datasets = ABOUT.datasets.filter((dataset) => SAMPLES.some((sample) => sample.compared.metrics[evaluation]?.[dataset]));
    const changes = datasets.filter((dataset) => dataset !== FIRST_DATASET && datasets.includes(FIRST_DATASET)).flatMap((dataset) => names.map((name) => ({
      key: `change~${evaluation}~${dataset}~${name}`, group: "Change of a metric", label: joined(`Change of ${name}`, dataset, evaluation), digits: 4,
      of: (sample) => {
        const [here, there] = [value(sample, dataset, name), value(sample, FIRST_DATASET, name)];
        return isNumber(here) && isNumber(there) ? Math.abs(here - there) : null;
      },
    })));
    const values = datasets.flatMap((dataset) => names.map((name) => ({
      key: `metric~${evaluation}~${dataset}~${name}`, group: "Metrics", label: joined(name, dataset, evaluation), digits: 4, of: (sample) => value(sample, dataset, name),
    })));
    return [...changes, ...values];
  });
}

const sortOf = (key) => SORTS.find((sort) => sort.key === key);

// Samples without a value come last in both orders.
function sorted(samples, key, isAscending) {
  const sort = sortOf(key);
  if (!sort) return isAscending ? [...samples].reverse() : samples;
  const sign = isAscending ? 1 : -1;
  const values = new Map(samples.map((sample) => [sample, sort.of(sample)]));
  const rank = (sample) => (isNumber(values.get(sample)) ? sign * values.get(sample) : Infinity);
  return [...samples].sort((a, b) => (rank(a) === rank(b) ? a.number - b.number : rank(a) < rank(b) ? -1 : 1));
}

function sortedValue(sample, key) {
  const value = sortOf(key)?.of(sample);
  return isNumber(value) ? rounded(value, sortOf(key).digits) : "–";
}
