// Loads WebAssembly that was compiled from C or C++ of this project. The functions of a system that it asks for do
// nothing: it has neither files nor clocks.

export async function load(bytes) {
  const module = await WebAssembly.compile(bytes);
  const system = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) {
    system[from] ??= {};
    system[from][name] = () => 0;
  }
  const { exports } = await WebAssembly.instantiate(module, system);
  exports._initialize?.();
  return exports;
}
