//! Parallel work with results in order.

use crate::error::{Error, Result};
use rayon::ThreadPoolBuilder;
use std::collections::VecDeque;
use std::fmt;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// Number of items per thread that are computed ahead.
const READY: u64 = 4;

/// An item, and the channel for its result.
type Job<T> = (u64, Sender<Result<T>>);

type Queue<T> = Arc<Mutex<Receiver<Job<T>>>>;

/// Results of `work` on items, in the order of the items, computed ahead on other threads.
///
/// A free thread takes the next item, so a slow item blocks no other thread until [`READY`] items per thread wait behind
/// it. Each thread works in a rayon pool of one thread, so n threads use n cores.
pub(super) struct Ordered<T> {
    items: Box<dyn Iterator<Item = u64> + Send>,
    /// Sender to the threads; `None` once no more results are wanted.
    jobs: Option<Sender<Job<T>>>,
    /// Items not yet taken by a thread.
    queue: Queue<T>,
    /// Pending results, in order.
    results: VecDeque<Receiver<Result<T>>>,
    threads: Vec<JoinHandle<()>>,
}

impl<T> fmt::Debug for Ordered<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ordered")
            .field("threads", &self.threads.len())
            .field("under_way", &self.results.len())
            .finish_non_exhaustive()
    }
}

impl<T: Send + 'static> Ordered<T> {
    /// Starts the threads.
    ///
    /// # Errors
    ///
    /// [`Error::Threads`] if a thread cannot be started.
    pub(super) fn new(
        items: impl Iterator<Item = u64> + Send + 'static,
        threads: usize,
        work: impl Fn(u64) -> Result<T> + Send + Sync + 'static,
    ) -> Result<Self> {
        let (jobs, queue) = channel::<Job<T>>();
        let (work, queue) = (Arc::new(work), Arc::new(Mutex::new(queue)));
        let mut ordered = Self {
            items: Box::new(items),
            jobs: Some(jobs),
            queue: Arc::clone(&queue),
            results: VecDeque::new(),
            threads: Vec::new(),
        };
        for k in 0..threads.max(1) {
            let (work, queue) = (Arc::clone(&work), Arc::clone(&queue));
            let pool = ThreadPoolBuilder::new()
                .num_threads(1)
                .build()
                .map_err(|e| no_thread(std::io::Error::other(e)))?;
            let thread = std::thread::Builder::new()
                .name(format!("simulate-{k}"))
                .spawn(move || {
                    while let Some((item, result)) = next_job(&queue) {
                        // Sending fails if the result is no longer wanted.
                        let _ = result.send(pool.install(|| work(item)));
                    }
                })
                .map_err(no_thread)?;
            ordered.threads.push(thread);
        }
        ordered.work_ahead();
        Ok(ordered)
    }

    /// Sends items to the threads until enough are pending.
    fn work_ahead(&mut self) {
        let ahead = READY as usize * self.threads.len();
        while let Some(jobs) = &self.jobs
            && self.results.len() < ahead
            && let Some(item) = self.items.next()
        {
            let (sender, result) = channel();
            self.results.push_back(result);
            // If no thread listens, receiving the result fails.
            let _ = jobs.send((item, sender));
        }
    }
}

/// Waits for the next item; `None` once there are no more.
fn next_job<T>(queue: &Queue<T>) -> Option<Job<T>> {
    let queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
    queue.recv().ok()
}

fn no_thread(source: std::io::Error) -> Error {
    Error::Threads { source }
}

impl<T> Ordered<T> {
    /// Lets every thread finish its current item, drops all others, and returns the panic of a thread, if any.
    fn stop(&mut self) -> std::thread::Result<()> {
        self.results.clear();
        self.jobs = None;
        while next_job(&self.queue).is_some() {}
        let ends: Vec<_> = self.threads.drain(..).map(JoinHandle::join).collect();
        ends.into_iter().collect()
    }
}

impl<T: Send + 'static> Iterator for Ordered<T> {
    type Item = Result<T>;

    /// The next result; `None` after the last one.
    ///
    /// # Panics
    ///
    /// With the panic of `work`, if it panicked.
    fn next(&mut self) -> Option<Self::Item> {
        let result = self.results.pop_front()?.recv();
        if result.is_err()
            && let Err(panic) = self.stop()
        {
            std::panic::resume_unwind(panic);
        }
        self.work_ahead();
        result.ok()
    }
}

impl<T> Drop for Ordered<T> {
    fn drop(&mut self) {
        // Panics are passed on by `next` alone.
        drop(self.stop());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    #[test]
    fn results_come_in_order_whoever_is_slow() {
        for threads in 1..=5 {
            let squares = Ordered::new(3..60, threads, |n| {
                std::thread::sleep(Duration::from_micros(n * 7919 % 500));
                Ok(n * n)
            });
            let squares: Vec<u64> = squares.unwrap().map(Result::unwrap).collect();
            assert_eq!(squares, (3..60).map(|n| n * n).collect::<Vec<_>>());
        }
        assert_eq!(Ordered::new(0..0, 3, Ok).unwrap().count(), 0);
    }

    /// While one thread waits at item 0, the other makes all further items: item 6 ends the wait.
    #[test]
    fn a_slow_item_holds_up_no_other_thread() {
        let (made, sixth) = channel();
        let (made, sixth) = (Mutex::new(made), Mutex::new(sixth));
        let work = move |n| {
            match n {
                0 => {
                    let waiting = sixth.lock().unwrap();
                    waiting.recv_timeout(Duration::from_secs(60)).unwrap();
                }
                6 => made.lock().unwrap().send(()).unwrap(),
                _ => {}
            }
            Ok(n)
        };
        let results = Ordered::new(0..20, 2, work).unwrap();
        assert_eq!(
            results.map(Result::unwrap).collect::<Vec<_>>(),
            (0..20).collect::<Vec<_>>()
        );
    }

    #[test]
    fn each_thread_has_a_pool_of_its_own() {
        let pools = Ordered::new(0..4, 2, |_| Ok(rayon::current_num_threads())).unwrap();
        assert!(pools.map(Result::unwrap).all(|threads| threads == 1));
    }

    #[test]
    fn an_error_is_passed_on_in_its_place() {
        let work = |n| match n {
            5 => Err(Error::Recipe {
                message: "five".to_owned(),
            }),
            n => Ok(n),
        };
        let results: Vec<bool> = Ordered::new(0..8, 3, work)
            .unwrap()
            .map(|r| r.is_ok())
            .collect();
        assert_eq!(results, [true, true, true, true, true, false, true, true]);
    }

    #[test]
    #[should_panic(expected = "three")]
    fn a_panic_is_passed_on() {
        let work = |n| if n == 3 { panic!("three") } else { Ok(n) };
        for result in Ordered::new(0..8, 2, work).unwrap() {
            assert!(result.unwrap() < 3);
        }
    }

    /// Work stays within the bounds of the queues, and ends when the results are dropped.
    #[test]
    fn queues_are_bounded() {
        let count = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&count);
        let mut endless = Ordered::new(0..u64::MAX, 2, move |n| {
            counted.fetch_add(1, Ordering::Relaxed);
            Ok(n)
        })
        .unwrap();
        assert_eq!(
            endless.by_ref().take(10).map(Result::unwrap).last(),
            Some(9)
        );
        std::thread::sleep(Duration::from_millis(20));
        drop(endless);
        // Ten taken, and the pending ones.
        assert!(count.load(Ordering::Relaxed) <= 10 + 2 * READY);
    }
}
