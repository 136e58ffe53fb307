//! Work on other threads, results in order.

use crate::error::{Error, Result};
use rayon::ThreadPoolBuilder;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;

/// Results that one thread may have ready before they are asked for.
const READY: usize = 4;

/// The results of `work` on some items, in the order of the items, computed ahead on other threads.
///
/// Thread k of n takes items k, k + n, k + 2n, … and puts its results into a short queue of its own; reading the queues
/// in turn gives the order of the items. Each thread works in a pool of one thread, so that n of them use n cores.
#[derive(Debug)]
pub(super) struct Ordered<T> {
    queues: Vec<Receiver<Result<T>>>,
    threads: Vec<Option<JoinHandle<()>>>,
    next: usize,
}

impl<T: Send + 'static> Ordered<T> {
    /// Starts the threads.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] if the system gives no thread.
    pub(super) fn new<I>(
        items: I,
        threads: usize,
        work: impl Fn(u64) -> Result<T> + Send + Sync + 'static,
    ) -> Result<Self>
    where
        I: Iterator<Item = u64> + Clone + Send + 'static,
    {
        let (work, threads) = (Arc::new(work), threads.max(1));
        let mut ordered = Self {
            queues: Vec::new(),
            threads: Vec::new(),
            next: 0,
        };
        for k in 0..threads {
            let (sender, queue) = sync_channel(READY);
            let share = items.clone().skip(k).step_by(threads);
            let work = Arc::clone(&work);
            let pool = ThreadPoolBuilder::new()
                .num_threads(1)
                .build()
                .map_err(|e| no_thread(std::io::Error::other(e)))?;
            let thread = std::thread::Builder::new()
                .name(format!("simulate-{k}"))
                .spawn(move || {
                    for item in share {
                        if sender.send(pool.install(|| work(item))).is_err() {
                            break;
                        }
                    }
                })
                .map_err(no_thread)?;
            ordered.queues.push(queue);
            ordered.threads.push(Some(thread));
        }
        Ok(ordered)
    }
}

fn no_thread(source: std::io::Error) -> Error {
    Error::Threads { source }
}

impl<T> Iterator for Ordered<T> {
    type Item = Result<T>;

    /// The next result; `None` after the last one.
    ///
    /// # Panics
    ///
    /// With the panic of `work`, if it panicked.
    fn next(&mut self) -> Option<Self::Item> {
        let k = self.next;
        match self.queues.get(k)?.recv() {
            Ok(result) => {
                self.next = (k + 1) % self.queues.len();
                Some(result)
            }
            Err(_) => {
                if let Some(Err(panic)) = self.threads[k].take().map(JoinHandle::join) {
                    std::panic::resume_unwind(panic);
                }
                None
            }
        }
    }
}

impl<T> Drop for Ordered<T> {
    /// Lets every thread finish what it is at.
    fn drop(&mut self) {
        self.queues.clear();
        for thread in self.threads.iter_mut().filter_map(Option::take) {
            // A panic was meant for `next`; nobody asks any more.
            drop(thread.join());
        }
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

    /// Nobody works ahead further than the queues hold, nor after the results are dropped.
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
        // Ten taken; of each thread a full queue and one result that found no room.
        assert!(count.load(Ordering::Relaxed) <= 10 + 2 * (READY as u64 + 1));
    }
}
