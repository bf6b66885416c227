//! `gpu-report`: what a user's card computes and how fast. Numbers come first: functions against f64, images against the CPU's
//! and against the truth; then each pass's time beside what its plan counts. One JSON document and one table.

mod correctness;
mod table;
mod times;

use anyhow::bail;
use scatter_gpu::harness::{FunctionCheck, HarnessDevice, adapter_names, check_functions, functions_module};
use scatter_gpu::wgpu;
use scatter_validate::{Machine, Row};
use serde::Serialize;
use serde_json::{Value, json};

use crate::Verdict;
use crate::flags::GpuReport;
use crate::output::{check_folder, print, print_json, stderr_line, write_text};
use crate::progress::Progress;
use times::TimedFrame;

/// Everything that a report says.
#[derive(Serialize)]
struct Report {
    machine: Machine,
    /// The card in one line.
    gpu: String,
    adapter: Value,
    limits: Value,
    /// A software driver on the CPU: its times are nobody's.
    emulated: bool,
    /// Whether passes are timed by timestamps; without them a frame's time is that of submit and wait.
    timestamps: bool,
    #[serde(serialize_with = "functions")]
    functions: Vec<FunctionCheck>,
    rows: Vec<Row>,
    times: Vec<TimedFrame>,
}

/// Checks, times, prints, writes.
pub fn run(flags: &GpuReport) -> anyhow::Result<Verdict> {
    if flags.list {
        let names = adapter_names();
        for (index, name) in names.iter().enumerate() {
            print(&format!("{index}: {name}\n"))?;
        }
        return Ok(if names.is_empty() { Verdict::OutOfTolerance } else { Verdict::Well });
    }
    if let Some(folder) = &flags.out {
        check_folder(folder)?;
    }
    if let Some(asked) = &flags.gpu_adapter {
        HarnessDevice::share(asked);
    }
    let report = measured(flags)?;
    let text = table::text(&report);
    if let Some(folder) = &flags.out {
        std::fs::create_dir_all(folder)?;
        write_text(
            &folder.join("gpu-report.json"),
            &format!("{}\n", serde_json::to_string_pretty(&report)?),
        )?;
        write_text(&folder.join("gpu-report.txt"), &text)?;
        stderr_line(&format!("wrote gpu-report.json and gpu-report.txt into {}", folder.display()));
    }
    if flags.json {
        print_json(&report)?;
    } else {
        print(&text)?;
    }
    Ok(if report.problems() == 0 { Verdict::Well } else { Verdict::OutOfTolerance })
}

fn measured(flags: &GpuReport) -> anyhow::Result<Report> {
    let progress = Progress::new(None);
    progress.stage("functions");
    // The lock is given back before techniques take it.
    let (gpu, functions) = match HarnessDevice::shared() {
        Ok(device) => (device.describe(), check_functions(&device, functions_module())),
        Err(none) => bail!("gpu-report: no adapter: {none}"),
    };
    stderr_line(&format!("gpu: {gpu}"));
    let rows = correctness::rows(flags.quick, &progress)?;
    let device = HarnessDevice::open_timed(flags.gpu_adapter.as_deref())?;
    let times = times::frames(&device, flags, &progress)?;
    Ok(Report {
        machine: Machine::this(),
        gpu,
        adapter: adapter(&device.info),
        limits: limits(&device.device.limits()),
        emulated: device.is_emulated(),
        timestamps: device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        functions,
        rows,
        times,
    })
}

impl Report {
    /// How many numbers are wrong.
    fn problems(&self) -> usize {
        self.functions.iter().filter(|check| !check.is_right()).count()
            + self.rows.iter().filter(|row| row.has_failed()).count()
            + self.times.iter().filter(|frame| frame.has_failed()).count()
    }
}

fn functions<S: serde::Serializer>(checks: &[FunctionCheck], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(checks.iter().map(|check| {
        json!({ "name": check.name, "inputs": check.inputs, "worst": check.worst, "at": check.at, "right": check.is_right() })
    }))
}

fn adapter(info: &wgpu::AdapterInfo) -> Value {
    json!({
        "name": info.name,
        "driver": info.driver,
        "driver_info": info.driver_info,
        "backend": format!("{:?}", info.backend),
        "device_type": format!("{:?}", info.device_type),
        "vendor": info.vendor,
        "device": info.device,
        "wgpu": "30",
    })
}

/// Those limits of the device that a plan is checked by.
fn limits(limits: &wgpu::Limits) -> Value {
    json!({
        "max_storage_buffer_binding_size": limits.max_storage_buffer_binding_size,
        "max_buffer_size": limits.max_buffer_size,
        "max_texture_dimension_2d": limits.max_texture_dimension_2d,
        "max_compute_workgroup_storage_size": limits.max_compute_workgroup_storage_size,
        "max_compute_invocations_per_workgroup": limits.max_compute_invocations_per_workgroup,
        "max_compute_workgroups_per_dimension": limits.max_compute_workgroups_per_dimension,
        "max_storage_buffers_per_shader_stage": limits.max_storage_buffers_per_shader_stage,
    })
}
