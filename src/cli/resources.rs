//! Resources of the process, as far as the system reports them (Linux).

use flexbody_linalg::context::{Context, Watch};
use std::sync::{Once, mpsc};

/// Ticks per second of the CPU times in /proc: fixed for user space on Linux.
const TICKS: f64 = 100.0;

/// Largest number of threads for each processor. More threads are not faster, and each takes memory: 10 000 threads on
/// two cores found eight modes of a cube in more than 100 s instead of 0.1 s, 16 000 used up the memory maps of the
/// process.
const MOST_PER_PROCESSOR: usize = 4;

/// Number of threads that is allowed however few processors there are.
const ALWAYS_ALLOWED: usize = 64;

/// Largest number of threads on any machine: each takes about four of the 65 530 memory maps of a process.
const MOST_THREADS: usize = 4096;

/// Stack size of each thread in bytes; the command itself runs in one of them.
const STACK: usize = 8 << 20;

/// Starts the threads of the process: the number `asked` for, otherwise one for each processor, limited to a sensible
/// number and to those that the system can start. Returns the number of threads. Results do not depend on it.
pub fn use_threads(asked: Option<u16>) -> usize {
    start(sensible_threads(asked));
    rayon::current_num_threads()
}

/// Runs work whose outcome depends on the number of threads, such as an estimate of memory, for a process that may have
/// more threads than this one.
#[cfg(feature = "cluster")]
pub(super) fn for_threads<T: Send>(asked: Option<u16>, work: impl FnOnce() -> T + Send) -> T {
    let wanted = sensible_threads(asked);
    if wanted <= rayon::current_num_threads() {
        return work();
    }
    match rayon::ThreadPoolBuilder::new().num_threads(wanted).stack_size(STACK).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

/// Returns the number of threads to start if `asked` are requested.
fn sensible_threads(asked: Option<u16>) -> usize {
    let environment = || std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok().filter(|&threads| threads > 0);
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let wanted = asked.map(usize::from).or_else(environment).unwrap_or(processors);
    wanted.min((MOST_PER_PROCESSOR * processors).clamp(ALWAYS_ALLOWED, MOST_THREADS))
}

/// Starts up to `wanted` threads and makes them the pool; if none can be started, this thread is the pool. The pool
/// cannot be built twice: its threads are started first, and receive their work once their number is known.
fn start(wanted: usize) {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let started = (0..wanted).map_while(|number| {
            let (work, receiver) = mpsc::channel::<rayon::ThreadBuilder>();
            let worker = std::thread::Builder::new().name(format!("worker {number}")).stack_size(STACK);
            worker.spawn(move || receiver.recv().map(rayon::ThreadBuilder::run)).ok().map(|_| work)
        });
        let started: Vec<_> = started.collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(started.len().max(1));
        let made = if started.is_empty() {
            pool.use_current_thread().build_global()
        } else {
            let mut started = started.into_iter();
            let hand_out = move |work| {
                let next = started.next().ok_or(std::io::ErrorKind::NotFound)?;
                next.send(work).map_err(|_| std::io::ErrorKind::NotFound.into())
            };
            pool.spawn_handler(hand_out).build_global()
        };
        // The build fails only if a pool exists already, which then remains.
        drop(made);
    });
}

/// Largest estimated duration of a search for modes, in seconds, unless the user allows longer work.
const LONGEST: f64 = 1800.0;

/// Returns the context of work that reports to `watch`, with limits of memory (the free memory, at most `memory_limit`)
/// and of time.
pub(super) fn context(memory_limit: Option<u64>, allow_long: bool, watch: Watch<'_>) -> Context<'_> {
    let longest = (!allow_long).then_some(LONGEST);
    Context { memory: memory_left(memory_limit), longest, ..Context::with_listener(watch) }
}

/// Returns true if another thread can be started.
pub(super) fn has_thread() -> bool {
    std::thread::Builder::new().spawn(|| ()).is_ok_and(|thread| thread.join().is_ok())
}

/// Returns the user and system CPU seconds of this process; zero if the system does not report them.
pub(super) fn cpu_seconds() -> f64 {
    let read = || {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        // The command name, in parentheses, may contain blanks: count fields from behind it.
        let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
        let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        Some(ticks / TICKS)
    };
    read().unwrap_or(0.0)
}

/// Returns the largest resident memory of this process so far, in bytes.
pub(super) fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    kibibytes(&status, "VmHWM:")
}

/// Returns the resident memory of this process, in bytes; zero if the system does not report it.
pub(super) fn resident_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    kibibytes(&status, "VmRSS:").unwrap_or(0)
}

/// Returns the number of bytes that may still be allocated: up to `limit` if the user states one, otherwise the free
/// memory of the machine, limited by the control groups and limits of this process. Returns `None` if the system does
/// not report it.
pub(super) fn memory_left(limit: Option<u64>) -> Option<u64> {
    if let Some(limit) = limit {
        return Some(limit.saturating_sub(resident_bytes()));
    }
    let machine = kibibytes(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:");
    machine.into_iter().chain(control_groups()).chain(process_limits()).min()
}

/// Returns the largest address space of this process in bytes (`ulimit -v`); `None` without a limit.
pub(super) fn address_space_limit() -> Option<u64> {
    process_limit(&std::fs::read_to_string("/proc/self/limits").ok()?, "Max address space")
}

/// Returns the limit of that name in a table of limits, in bytes.
fn process_limit(limits: &str, key: &str) -> Option<u64> {
    let line = limits.lines().find(|line| line.starts_with(key))?;
    line[key.len()..].split_whitespace().next()?.parse::<u64>().ok()
}

/// Returns the memory that the limits of this process leave, in bytes (`ulimit -v` and `-d`). The limits count address
/// space, of which more is reserved than is in use: a process close to a limit may still reach it.
fn process_limits() -> Vec<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let given =
        ["Max address space", "Max data size"].into_iter().filter_map(|key| process_limit(&limits, key));
    given.map(|limit| limit.saturating_sub(resident_bytes())).collect()
}

/// Returns the memory that each control group of this process leaves, in bytes (versions 1 and 2). Pages of mapped
/// files count as free.
fn control_groups() -> Vec<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let mut left = Vec::new();
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (fields.next(), fields.next()) else { continue };
        let (root, limit, used) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            _ if controllers.split(',').any(|c| c == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes")
            }
            _ => continue,
        };
        // A group is also limited by its parents. Inside a container the process's own group is the root.
        let own = std::path::Path::new(root).join(path.trim_start_matches('/'));
        for folder in own.ancestors().take_while(|folder| folder.starts_with(root)) {
            let number =
                |name: &str| std::fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
            let Some(limit) = number(limit) else { continue };
            let statistics = std::fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
            let pages =
                statistics.lines().find_map(|line| line.strip_prefix("inactive_file ")?.parse::<u64>().ok());
            let used = number(used).unwrap_or(0).saturating_sub(pages.unwrap_or(0));
            left.push(limit.saturating_sub(used));
        }
    }
    left
}

/// Returns a line of a table of /proc in bytes.
fn kibibytes(table: &str, key: &str) -> Option<u64> {
    let line = table.lines().find(|line| line.starts_with(key))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}
