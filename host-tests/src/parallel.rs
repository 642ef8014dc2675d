//! Drives side by side: each takes a core for tens of seconds.

/// A table of the lines that `judge` gives for each item, printed; what does not hold is told with it.
///
/// # Panics
/// Where something does not hold.
pub fn table<T: Sync>(heading: &str, items: &[T], judge: impl Fn(&T) -> (String, Vec<String>) + Sync) {
    let (lines, failures): (Vec<_>, Vec<_>) = map(items, judge).into_iter().unzip();
    let table = format!("{heading}\n{}", lines.concat());
    println!("{table}");
    assert!(failures.concat().is_empty(), "{failures:#?}\n{table}");
}

/// What `judge` says of each item, a thread for each, in their order.
///
/// # Panics
/// When one of them does.
pub fn map<T: Sync, R: Send>(items: &[T], judge: impl Fn(&T) -> R + Sync) -> Vec<R> {
    std::thread::scope(|scope| {
        let judge = &judge;
        let running: Vec<_> = items.iter().map(|item| scope.spawn(move || judge(item))).collect();
        let resume = |panic| std::panic::resume_unwind(panic);
        running.into_iter().map(|thread| thread.join().unwrap_or_else(resume)).collect()
    })
}
