// Compiles the WGSL modules that stdin brings as JSON; prints the errors of each, a list a module.
const { create } = require('webgpu');
(async () => {
  const sources = JSON.parse(require('fs').readFileSync(0, 'utf8'));
  const adapter = await create(['backend=null']).requestAdapter();
  if (!adapter) process.exit(3);
  const device = await adapter.requestDevice();
  const errors = [];
  for (const { code } of sources) {
    device.pushErrorScope('validation');
    const info = await device.createShaderModule({ code }).getCompilationInfo();
    await device.popErrorScope();
    const bad = [...info.messages].filter((message) => message.type === 'error');
    errors.push(bad.map((message) => `line ${message.lineNum}: ${message.message}`));
  }
  process.stdout.write(JSON.stringify(errors), () => process.exit(0));
})();
