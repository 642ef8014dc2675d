//! Work side by side, because each recording keeps a core busy for seconds.

/// Prints a table of the lines that `judge` returns for each item, with the failures that it reports.
pub fn table<T: Sync>(heading: &str, items: &[T], judge: impl Fn(&T) -> (String, Vec<String>) + Sync) {
    let (lines, failures): (Vec<_>, Vec<_>) = map(items, judge).into_iter().unzip();
    let table = format!("{heading}\n{}", lines.concat());
    println!("{table}");
    assert!(failures.concat().is_empty(), "{failures:#?}\n{table}");
}

/// The results of `judge` in the items' order; each item has a thread.
pub fn map<T: Sync, R: Send>(items: &[T], judge: impl Fn(&T) -> R + Sync) -> Vec<R> {
    std::thread::scope(|scope| {
        let judge = &judge;
        let running: Vec<_> = items.iter().map(|item| scope.spawn(move || judge(item))).collect();
        let resume = |panic| std::panic::resume_unwind(panic);
        running.into_iter().map(|thread| thread.join().unwrap_or_else(resume)).collect()
    })
}
