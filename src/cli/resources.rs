//! What the process has used so far, where the system tells (Linux).

/// Ticks per second of the CPU times in /proc: fixed for user space on Linux.
const TICKS: f64 = 100.0;

/// User and system CPU seconds of this process; zero where the system does not tell.
pub(super) fn cpu_seconds() -> f64 {
    let read = || {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        // The command name, in parentheses, may hold blanks: fields count from behind it.
        let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
        let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        Some(ticks / TICKS)
    };
    read().unwrap_or(0.0)
}

/// Largest resident memory of this process so far, in bytes.
pub(super) fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}
