// The same sums by visiting every run before each ask's end: the reference of `sums`, and cheaper for rows of few runs.

@compute @workgroup_size(256)
fn direct(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let task = tasks[group.x];
    for (var at = thread; at < task.ask_count; at += 256u) {
        let ask = asks[task.first_ask + at];
        let end_run = min(ask.run, max(task.run_count, 1u) - 1u);
        var sum = vec4<i32>(0);
        for (var run = 0u; run < end_run; run++) {
            let first = task.first_prefix + run;
            sum += select(vec4<i32>(0), run_prefixes[first + 1u] - run_prefixes[first], lit_of(task, run) > ask.rank);
        }
        sum += select(vec4<i32>(0), ask.end - run_prefixes[task.first_prefix + end_run], lit_of(task, end_run) > ask.rank);
        answers[ask.answer] = sum;
    }
}
