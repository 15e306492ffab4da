//! Work on the stores that a caller who goes away does not break off.

use super::store::StoreError;

/// Carries out work to its end, even if the caller is dropped meanwhile: the client of a request may disconnect, or its time be over.
pub async fn to_its_end<T: Send + 'static>(
    work: impl Future<Output = Result<T, StoreError>> + Send + 'static,
) -> Result<T, StoreError> {
    tokio::spawn(work).await.map_err(|error| StoreError::Failed(error.to_string()))?
}

#[cfg(test)]
mod tests {
    use futures::FutureExt;
    use tokio::sync::oneshot;

    use super::*;

    #[tokio::test]
    async fn who_goes_away_breaks_nothing_off() {
        let (begin, begun) = oneshot::channel();
        let (end, ended) = oneshot::channel();
        let mut work = Box::pin(to_its_end(async move {
            let number: u32 = begun.await.unwrap();
            end.send(number).unwrap();
            Ok(())
        }));
        assert!((&mut work).now_or_never().is_none());
        drop(work);
        begin.send(7).unwrap();
        assert_eq!(ended.await, Ok(7));
    }
}
